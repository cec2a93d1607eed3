"""Random control of the MuJoCo environment: count the steps that diverge, and any that hide it.

python -m benchmarks.physics_soak [--steps 10000000] [--sim-dt 0.005] [--out docs/validation]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import write_text
from clarke_gym.numerics.arrays import FloatArray

BATCH = 256
EPISODE = 50
SEGMENTS, COUNTS = (1, 2, 3), (3, 7, 16)
ROUNDS = 8
POLICIES = ("raw", "clarke", "extreme", "constant", "alternating")


def actions(policy: str, size: int, seed: int) -> Iterator[FloatArray]:
    """Yield batches of actions for ever: in Clarke coordinates for "clarke", raw otherwise."""
    rng = np.random.default_rng(seed)
    shape = (BATCH, size)
    held = rng.uniform(-1.0, 1.0, shape)
    for step in range(10**9):
        if step % EPISODE == 0:
            held = rng.uniform(-1.0, 1.0, shape)
        if policy == "extreme":
            yield rng.choice([-1.0, 1.0], shape)
        elif policy == "constant":
            yield held
        elif policy == "alternating":  # from limit to limit, as fast as the drives may move
            yield np.sign(held) * (1.0 if step // 10 % 2 else -1.0)
        else:
            yield rng.uniform(-1.0, 1.0, shape)


def soak(
    segments: int, n: int, policy: str, steps: int, sim_dt: float | None, seed: int
) -> FloatArray:
    """Return how many steps ran, diverged, and showed a number that is not finite."""
    envs: Any = gym.make_vec(
        "clarke_gym/Reach-v0",
        num_envs=BATCH,
        vectorization_mode="vector_entry_point",
        n_segments=segments,
        n_tendons=n,
        physics="mujoco",
        representation="clarke" if policy == "clarke" else "raw",
        control="absolute" if policy == "alternating" else "increment",
        sim_dt_s=sim_dt,
    )
    envs.reset(seed=seed * BATCH)
    # A divergence is what ends an episode; the time limit gives a new shape and goal.
    ran = diverged = broken = 0
    for action in actions(policy, envs.single_action_space.shape[0], seed):
        observation, reward, terminated, _, info = envs.step(action)
        ran += BATCH
        diverged += int(info["diverged"].sum())
        finite = np.isfinite(observation).all() and np.isfinite(reward).all()
        broken += int(not (finite and np.array_equal(terminated, info["diverged"])))
        if ran >= steps:
            envs.close()
            return np.array([ran, diverged, broken])
    raise AssertionError("the actions never end")


def main() -> None:
    """Soak every robot under every policy; print and write a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics_soak")
    parser.add_argument("--steps", type=float, default=1e7, help="control steps in all")
    parser.add_argument("--sim-dt", type=float, help="time step [s]; the profile's by default")
    parser.add_argument("--out", type=Path, default=Path("docs/validation"), help="output folder")
    options = parser.parse_args()
    cases = [(s, n, policy) for s in SEGMENTS for n in COUNTS for policy in POLICIES]
    counts = np.zeros((len(cases), 3), dtype=int)
    share = int(np.ceil(options.steps / len(cases) / ROUNDS))
    with tqdm(total=ROUNDS * len(cases), unit="case", file=sys.stdout, mininterval=5.0) as bar:
        for turn in range(ROUNDS):  # an early end leaves every case with its share
            for k, case in enumerate(cases):
                seed = turn * len(cases) + k
                counts[k] += soak(*case, share, options.sim_dt, seed).astype(int)
                bar.update()
            write_text(options.out / "physics_soak.md", table(cases, counts, options.sim_dt))
    print(table(cases, counts, options.sim_dt))


def table(cases: list[tuple[int, int, str]], counts: NDArray[np.int_], dt: float | None) -> str:
    """Return the counts so far as a Markdown table."""
    lines = [
        f"Environment steps, physics mujoco, profile fast, 50 ms control, "
        f"time step {dt or 'of the profile'}, episodes of {EPISODE} steps.",
        "",
        "| segments | tendons | policy | control steps | diverged | not finite |",
        "| ---: | ---: | --- | ---: | ---: | ---: |",
    ]
    rows = [(*case, *row) for case, row in zip(cases, counts.tolist(), strict=True)]
    rows.append(("", "", "all", *counts.sum(axis=0).tolist()))
    lines += [f"| {s} | {n} | {p} | {ran:,} | {d} | {b} |" for s, n, p, ran, d, b in rows]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
