"""A task of your own in one file: draw a circle with the tip, between two bars.

python examples/own_task.py
"""

import gymnasium as gym
import numpy as np

import clarke_gym
from clarke_gym.robots.scene import Capsule, Scene

SPEED_HZ = 0.2


@clarke_gym.register_task("draw_circle")
class DrawCircle(clarke_gym.GoalTask):
    """Follow a point on a circle; its radius and phase are drawn anew for every episode."""

    max_episode_steps = 100
    numbers = 2

    def __init__(self, robot, *, tolerance_m=0.005):
        super().__init__(robot)
        length = robot.length_m
        self.tolerance_m = tolerance_m
        self.goal = clarke_gym.Goal(("x", "y", "z"), "m", scale=length)
        self.metrics = (clarke_gym.Metric("tip_error_m", "tip error", "m", worst=2.0 * length),)
        self.scene = Scene(
            tuple(
                Capsule((x, -length, 0.6 * length), (x, length, 0.6 * length), 0.02 * length)
                for x in (-0.6 * length, 0.6 * length)
            )
        )

    def begin(self, numbers):
        start = np.zeros((len(numbers), self.robot.n_segments, 2))
        radius = self.robot.length_m * (0.2 + 0.2 * numbers[:, 0])
        return start, np.stack([radius, 2.0 * np.pi * numbers[:, 1]], axis=1)

    def advance(self, parameters, time_s):
        radius, phase = parameters.T
        angle = phase + 2.0 * np.pi * SPEED_HZ * time_s
        height = 0.9 * self.robot.length_m + 0.0 * angle
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)

    def achieved(self, state):
        return state.tip_position

    def score(self, achieved, desired):
        error = np.linalg.norm(achieved - desired, axis=1)
        return clarke_gym.Outcome(
            reward=np.exp(-error / 0.02),
            success=error <= self.tolerance_m,
            metrics={"tip_error_m": error},
        )


def main() -> None:
    """Step the task for a thousand steps, in Clarke coordinates."""
    envs = gym.make_vec(
        "clarke_gym/Task-v0", num_envs=10, task="draw_circle", n_tendons=5, representation="clarke"
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    for _ in range(100):
        _, rewards, _, _, infos = envs.step(envs.action_space.sample())
    print(envs.unwrapped.sensors.table())
    error = 1e3 * infos["tip_error_m"].mean()
    print(f"mean reward {rewards.mean():.3f}, mean error {error:.1f} mm")


if __name__ == "__main__":
    main()
