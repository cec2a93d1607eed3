"""What wrappers of goal environments have in common."""

from __future__ import annotations

from typing import Any


class AsksRewards:
    """Goal environments are asked for rewards through their wrappers, too."""

    unwrapped: Any

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the environment's reward of goals as observed."""
        return self.unwrapped.compute_reward(achieved_goal, desired_goal, info)
