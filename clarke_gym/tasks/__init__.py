"""Tasks: goal, observation, reward and success, over any physics."""
