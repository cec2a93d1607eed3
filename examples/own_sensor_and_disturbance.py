"""A sensor and a disturbance of your own, each a small class with a name.

python examples/own_sensor_and_disturbance.py
"""

import gymnasium as gym
import numpy as np

import clarke_gym


@clarke_gym.register_sensor("tip_height")
class TipHeight(clarke_gym.TaskSensor):
    """How high the tip is."""

    unit = "m"
    labels = ("z",)

    @property
    def scale(self):
        return self.plant.robot.length_m

    def read(self, state, goal):
        return state.tip_position[:, 2:]


@clarke_gym.register_disturbance("weak_drives")
class WeakDrives(clarke_gym.Disturbance):
    """Drives that pull by up to a fifth less than they are told, drawn for every episode."""

    numbers = 1

    def __init__(self, robot, num_envs):
        super().__init__(robot, num_envs)
        self._share = np.ones((num_envs, 1))

    def reset(self, rows, numbers, command):
        self._share[rows] = 1.0 - 0.2 * numbers

    def step(self, command):
        return self._share * command

    def get_state(self):
        return {"share": self._share.copy()}

    def set_state(self, state):
        self._share = state["share"].copy()


def main() -> None:
    """Step an environment with both for a thousand steps."""
    env = gym.make(
        "clarke_gym/Reach-v0",
        n_tendons=4,
        representation="clarke",
        sensors="command+tendons+tip_height",
        disturbances="weak_drives+backlash",
    )
    env.reset(seed=0)
    env.action_space.seed(0)
    for _ in range(1000):
        _, _, terminated, truncated, _ = env.step(env.action_space.sample())
        if terminated or truncated:
            env.reset()
    print(env.unwrapped.sensors.table())


if __name__ == "__main__":
    main()
