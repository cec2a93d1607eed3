"""Random control of the MuJoCo physics: count the steps that diverge, and any that hide it.

python -m benchmarks.physics_soak [--steps 10000000] [--sim-dt 0.005] [--out docs/validation]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from agents.files import write_text
from clarke_gym._arrays import FloatArray
from clarke_gym.physics.base import JointVector
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.presets import make_robot
from clarke_gym.robots import Robot

CONTROL_DT = 0.05
BATCH = 256
EPISODE = 50
SEGMENTS, COUNTS = (1, 2, 3), (3, 7, 16)
ROUNDS = 8
POLICIES = ("raw", "clarke", "extreme", "constant", "alternating")


def commands(policy: str, robot: Robot, seed: int) -> Iterator[JointVector]:
    """Yield commands within the environment's limits for ever."""
    rng = np.random.default_rng(seed)
    shape = (BATCH, robot.n_segments, 2)
    limit = robot.max_clarke[:, None]
    rate = robot.max_tendon_speed_m_s * CONTROL_DT
    clarke, off = np.zeros(shape), np.zeros((BATCH, robot.n_joints))
    held = rng.uniform(-1.0, 1.0, shape)
    for step in range(10**9):
        if step % EPISODE == 0:
            held = rng.uniform(-1.0, 1.0, shape)
        if policy == "raw":
            action = rng.uniform(-1.0, 1.0, (BATCH, robot.n_joints))
            part = action @ robot.encoder.T
            clarke = clarke + rate * part.reshape(shape)
            off = off + 0.1 * robot.max_cocontraction_m * (action - part @ robot.decoder.T)
            bound = np.abs(off).max(axis=1, keepdims=True) / robot.max_cocontraction_m
            off = off / np.maximum(bound, 1.0)
        elif policy == "clarke":
            clarke = clarke + rate * rng.uniform(-1.0, 1.0, shape)
        elif policy == "extreme":
            clarke = clarke + rate * rng.choice([-1.0, 1.0], shape)
        elif policy == "constant":
            clarke = clarke + rate * held
        else:  # whole range back and forth, as fast as the drives may move
            clarke = limit * np.where(step // 10 % 2, 1.0, -1.0) * np.sign(held)
        clarke = clarke / np.maximum(np.linalg.norm(clarke, axis=-1, keepdims=True) / limit, 1.0)
        yield JointVector.from_clarke(clarke, off if policy == "raw" else None)


def soak(robot: Robot, policy: str, steps: int, sim_dt: float | None, seed: int) -> FloatArray:
    """Return how many steps ran, diverged, and showed a number that is not finite."""
    physics = MujocoPhysics(robot, BATCH, CONTROL_DT, threads=2, sim_dt_s=sim_dt)
    ran = diverged = broken = 0
    for command in commands(policy, robot, seed):
        physics.step(command)
        state = physics.state
        ran += BATCH
        diverged += int(state.diverged.sum())
        tip, displacement = state.tip_position, state.displacement.clarke
        broken += int((~np.isfinite(tip)).any() or (~np.isfinite(displacement)).any())
        rows = np.flatnonzero(state.diverged)
        if rows.size:
            physics.reset(rows, command.clarke[rows])
        if ran >= steps:
            return np.array([ran, diverged, broken])
    raise AssertionError("the commands never end")


def main() -> None:
    """Soak every robot under every policy; print and write a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics_soak")
    parser.add_argument("--steps", type=float, default=1e7, help="control steps in all")
    parser.add_argument("--sim-dt", type=float, help="time step [s]; the profile's by default")
    parser.add_argument("--out", type=Path, default=Path("docs/validation"), help="output folder")
    options = parser.parse_args()
    cases = [(s, n, policy) for s in SEGMENTS for n in COUNTS for policy in POLICIES]
    counts = np.zeros((len(cases), 3), dtype=int)
    share = int(options.steps / len(cases) / ROUNDS)
    with tqdm(total=ROUNDS * len(cases), unit="case", file=sys.stdout, mininterval=5.0) as bar:
        for turn in range(ROUNDS):  # an early end leaves every case with its share
            for k, (s, n, policy) in enumerate(cases):
                robot = make_robot(n_segments=s, n_tendons=n)
                seed = turn * len(cases) + k
                counts[k] += soak(robot, policy, share, options.sim_dt, seed).astype(int)
                bar.update()
            write_text(options.out / "physics_soak.md", table(cases, counts, options.sim_dt))
    print(table(cases, counts, options.sim_dt))


def table(cases: list[tuple[int, int, str]], counts: NDArray[np.int_], dt: float | None) -> str:
    """Return the counts so far as a Markdown table."""
    lines = [
        f"Profile fast, {1e3 * CONTROL_DT:g} ms control, time step {dt or 'of the profile'}, "
        "commands within the environment's limits.",
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
