"""How far an untrained policy's noise moves the tip: docs/validation/exploration.md.

python -m benchmarks.exploration

A confound of the comparison, measured for every representation.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import write_text
from benchmarks.committed_scores import DOCS
from clarke_gym.representations import representation_names

ENVS, STEPS, COUNTS = 512, 50, (3, 7, 11)
PAGE = "validation/exploration.md"


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
    """Write a table over representations and numbers of tendons."""
    names = [name for name in representation_names() if name != "antagonistic"]
    heads = [f"{what}, n = {n}" for what in ("tip motion", "dome") for n in COUNTS]
    lines = [
        "Unit Gaussian noise, clipped to the action box, 0.2 m robot, episodes of "
        f"{STEPS} steps from the straight shape, {ENVS} environments: RMS motion of the tip a step "
        "[mm], and the share of its dome that is visited [%].",
        "",
        "| " + " | ".join(["representation", *heads]) + " |",
        "|" + "---|" * (1 + len(heads)),
    ]
    for name in names:
        moved, seen = zip(*(tip_motion(name, n) for n in COUNTS), strict=True)
        cells = [f"{rms:.2f}" for rms in moved] + [f"{100.0 * share:.1f}" for share in seen]
        lines.append("| " + " | ".join([name, *cells]) + " |")
        print(lines[-1], flush=True)
    write_text(DOCS / PAGE, "\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
