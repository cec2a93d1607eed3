"""A robot of your own: from a YAML file, from numbers, and by a name that specs can carry.

python examples/own_robot.py
"""

from pathlib import Path

import gymnasium as gym

import clarke_gym

ARM = Path(__file__).parent.parent / "configs" / "robots" / "example_arm.yaml"

clarke_gym.register_robot("example_arm", ARM)
clarke_gym.register_robot(
    "tapered",
    clarke_gym.Robot(
        (
            clarke_gym.Segment(n_tendons=4, pitch_radius_m=0.012),
            clarke_gym.Segment(n_tendons=4, pitch_radius_m=0.008),
        )
    ),
)


def main() -> None:
    """Step each of them for a thousand steps."""
    for robot in (str(ARM), "example_arm", "tapered"):
        env = gym.make("clarke_gym/Reach-v0", robot=robot, representation="clarke")
        env.reset(seed=0)
        env.action_space.seed(0)
        for _ in range(1000):
            _, _, terminated, truncated, _ = env.step(env.action_space.sample())
            if terminated or truncated:
                env.reset()
        print(f"{env.unwrapped.robot.name}: {env.unwrapped.robot.n_joints} tendons")


if __name__ == "__main__":
    main()
