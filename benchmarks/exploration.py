"""How far an untrained policy's noise moves the tip, by representation: a confound, measured.

python -m benchmarks.exploration
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.representations import representation_names

ENVS, STEPS = 512, 50


def tip_motion(representation: str, n_tendons: int) -> tuple[float, float]:
    """Return RMS tip motion a step [mm] and covered share of the dome under unit Gaussian noise.

    The share counts the cells of an equal-area grid (12 rings of bending x 24 directions) that the
    tips of all environments visit in one episode from the straight shape.
    """
    envs = gym.make_vec(
        "clarke_gym/Reach-v0",
        num_envs=ENVS,
        n_tendons=n_tendons,
        representation=representation,
        random_start=False,
        episode_steps=STEPS + 1,
    )
    envs.reset(seed=0)
    face: Any = envs.unwrapped
    rng = np.random.default_rng(0)
    low, high = envs.action_space.low, envs.action_space.high  # type: ignore[attr-defined]
    previous = face.physics.state.tip_position
    squares, tips = [], []
    for _ in range(STEPS):
        noise = rng.normal(size=low.shape)
        envs.step(np.clip(noise, low, high).astype(np.float32))  # SB3 clips to the box, too
        tip = face.physics.state.tip_position
        squares.append(((tip - previous) ** 2).sum(axis=1))
        tips.append(tip)
        previous = tip
    x, y, z = np.concatenate(tips).T
    angle = 2.0 * np.arctan2(np.hypot(x, y), z)
    rings = 1.0 - np.cos(np.minimum(angle, face.robot.max_bending[0]) / 2.0)
    rings = np.minimum(11, (12 * rings / (1.0 - np.cos(face.robot.max_bending[0] / 2.0)))).astype(
        int
    )
    sectors = ((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * 24).astype(int) % 24
    covered = len(np.unique(rings * 24 + sectors)) / (12 * 24)
    return float(np.sqrt(np.mean(squares)) * 1e3), covered


def main() -> None:
    """Print a table over representations and numbers of tendons."""
    counts = (3, 7, 11)
    print("RMS tip motion a step [mm] and share of the dome visited, N(0, 1) noise, 0.2 m robot")
    print("representation " + "".join(f"      n = {n:<9d}" for n in counts))
    for name in representation_names():
        if name == "antagonistic":
            continue
        cells = [tip_motion(name, n) for n in counts]
        print(f"{name:15s}" + "".join(f"{rms:8.2f} {share:8.1%} " for rms, share in cells))


if __name__ == "__main__":
    main()
