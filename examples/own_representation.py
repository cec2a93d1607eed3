"""A representation of your own: Clarke coordinates whose axes follow two tendons at 120 degrees.

python examples/own_representation.py
"""

import gymnasium as gym
import numpy as np

import clarke_gym


def oblique(segment):
    """Return (decoder (n, 2), encoder (2, n)) of coordinates along the angles 0 and 120 degrees."""
    encoder, decoder = segment.matrices
    axes = np.array([[1.0, -0.5], [0.0, np.sqrt(0.75)]])
    return decoder @ axes, np.linalg.solve(axes, encoder)


clarke_gym.register_representation("oblique", oblique)


def main() -> None:
    """Step an environment for a thousand steps."""
    env = gym.make("clarke_gym/Reach-v0", n_tendons=6, representation="oblique")
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(1000):
        _, _, terminated, truncated, info = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
    print(f"{env.action_space}, last tip error {1e3 * info['tip_error_m']:.1f} mm")


if __name__ == "__main__":
    main()
