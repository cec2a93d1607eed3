"""Trajectories recorded before the rooms were rebuilt: what users had must stay as it was.

``python -m tests.regression.trajectories`` records them anew; say in the commit which numbers
moved, by how much and why.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from itertools import cycle, product
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import clarke_gym  # noqa: F401  (registers the environments)

FILE = Path(__file__).with_name("trajectories.npz")

STEPS = 8

REPRESENTATIONS = (
    "raw",
    "raw_scaled",
    "projected",
    "clarke",
    "rotated",
    "two_tendon",
    "random_basis",
    "arc_polar",
    "clarke_common",
    "della_santina_2020",
)

PHYSICS: tuple[dict[str, Any], ...] = (
    {"physics": "constant_curvature"},
    {"physics": "mujoco", "profile": "fast"},
    {"physics": "mujoco", "profile": "accurate"},
)

VARIANTS: tuple[dict[str, Any], ...] = tuple(
    {"control": control, **reward, **robot}
    for control, reward, robot in product(
        ("increment", "absolute"),
        ({"reward": "dense"}, {"reward": "sparse"}, {"reward": "dense", "goal_env": True}),
        ({}, {"random_start": False}),
    )
)


def cases() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (name, keywords of `gym.make`); the variants take turns over the grid."""
    variant = cycle(VARIANTS)
    for physics, name, segments, n in product(PHYSICS, REPRESENTATIONS, (1, 2, 3), (3, 7, 16)):
        keywords = {**physics, "representation": name, "n_segments": segments, "n_tendons": n}
        keywords |= next(variant)
        yield "-".join(str(value) for value in keywords.values()), keywords
    for physics in PHYSICS:
        keywords = {**physics, "representation": "antagonistic", "n_tendons": 4}
        yield "-".join(str(value) for value in keywords.values()), keywords
        for preset in ("two_segment_4", "slim", "soft_arm", "hardware"):
            keywords = {**physics, "robot": preset, "representation": "clarke"}
            yield "-".join(str(value) for value in keywords.values()), keywords


def roll(name: str, keywords: dict[str, Any]) -> NDArray[np.float64]:
    """Return rewards, tip errors and the last observation of one short episode, in one row.

    Half the actions are large, as a policy that explores makes them; half are small.
    """
    env = gym.make("clarke_gym/Reach-v0", **keywords)
    seed = zlib.crc32(name.encode())
    rng = np.random.default_rng(seed)
    observation, _ = env.reset(seed=seed)
    numbers: list[float] = []
    for step in range(STEPS):
        size = 1.0 if step < STEPS // 2 else 0.2
        action = rng.uniform(-size, size, env.action_space.shape).astype(np.float32)
        observation, reward, terminated, truncated, info = env.step(action)
        numbers += [float(reward), float(info["tip_error_m"]), float(terminated), float(truncated)]
    parts = observation.values() if isinstance(observation, dict) else [observation]
    env.close()
    return np.concatenate([numbers, *parts])


def main() -> None:
    """Record every case."""
    np.savez_compressed(
        FILE, **{name: roll(name, keywords).astype(np.float32) for name, keywords in cases()}
    )
    print(f"{FILE}: {FILE.stat().st_size / 1e3:.0f} kB, {sum(1 for _ in cases())} trajectories")


if __name__ == "__main__":
    main()
