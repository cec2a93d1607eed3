"""Speed of the MuJoCo physics, as ratios of medians inside one run, on one core.

python -m benchmarks.physics_speed [--out docs/validation]
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import itertools
from pathlib import Path
from typing import Any
from unittest import mock

import gymnasium as gym
import mujoco
import numpy as np
from matplotlib.figure import Figure

import clarke_gym  # noqa: F401  (registers the environments)
from benchmarks.timing import Workload, seconds_per_call
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.presets import make_robot

BATCH = 64
CONTROL_DT = 0.02
ROUNDS = 7
COUNTS = (3, 8, 16, 32)
SEGMENTS = (1, 2, 3)
ENV_ID = "clarke_gym/Reach-v0"
ENV_DT = 0.05
EPISODE = 50
STATE = sum(
    int(part)
    for part in (
        mujoco.mjtState.mjSTATE_QPOS,
        mujoco.mjtState.mjSTATE_QVEL,
        mujoco.mjtState.mjSTATE_ACT,
        mujoco.mjtState.mjSTATE_CTRL,
    )
)
ACTION_SHARE = 0.3  # of the largest action, so that no robot meets its limits


def moving(robot: Robot, off_manifold: float, **options: Any) -> Workload:
    """Return one control step of a batch that follows changing commands."""
    physics = MujocoPhysics(robot, BATCH, CONTROL_DT, threads=1, **options)
    commands = [_command(robot, phase, off_manifold) for phase in np.linspace(0.0, 2 * np.pi, 65)]
    physics.reset(np.arange(BATCH), commands[0].clarke)
    count = 0

    def step() -> None:
        nonlocal count
        count += 1
        physics.step(commands[count % 64])
        assert not physics.state.diverged.any()

    return step


def _command(robot: Robot, phase: float, off_manifold: float) -> JointVector:
    # Every robot draws a circle at a fifth of its largest bend, from its own starting angle.
    angle = phase + 2.0 * np.pi * np.arange(BATCH)[:, None] / BATCH
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    clarke = 0.2 * robot.max_clarke[:, None] * circle
    off: FloatArray | None = None
    if off_manifold:
        off = np.full((BATCH, robot.n_joints), -off_manifold)
        off -= (off @ robot.encoder.T) @ robot.decoder.T
    return JointVector.from_clarke(clarke, off)


def actor(count: int, profile: str, segments: int) -> tuple[Any, Workload]:
    """Return an environment, a batch or the scalar one for `count` 1, and one step of it."""
    keywords: dict[str, Any] = {"physics": "mujoco", "profile": profile, "n_segments": segments}
    keywords |= {"representation": "clarke", "control_dt": ENV_DT, "threads": 1}
    turn = itertools.count()
    if count > 1:
        envs: Any = gym.make_vec(
            ENV_ID, num_envs=count, vectorization_mode="vector_entry_point", **keywords
        )
        envs.reset(seed=0)
        envs.action_space.seed(0)
        actions = [ACTION_SHARE * envs.action_space.sample() for _ in range(16)]
        return envs, lambda: envs.step(actions[next(turn) % 16])
    env: Any = gym.make(ENV_ID, **keywords)
    env.reset(seed=0)
    env.action_space.seed(0)
    single = [ACTION_SHARE * env.action_space.sample() for _ in range(64)]

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(single[next(turn) % 64])
        if terminated or truncated:
            env.reset()

    return env, step


def bare(count: int, profile: str, segments: int) -> Workload:
    """Return the same control steps in a bare loop of `mj_step`, replayed from an environment."""
    env, work = actor(count, profile, segments)
    engine = env.unwrapped.physics._engine
    chain = engine.chain
    tape: list[FloatArray] = []
    run = engine.run

    def recorded(rows: Any, start: Any, control: Any, steps: int) -> Any:
        parts = engine.qpos, engine.qvel, np.atleast_2d(start), np.atleast_2d(control)
        tape.append(np.concatenate(parts, axis=1))
        return run(rows, start, control, steps)

    with mock.patch.object(engine, "run", recorded):
        for _ in range(EPISODE if count > 1 else 8 * EPISODE):
            work()
    steps = round(ENV_DT / chain.model.opt.timestep)
    data = [mujoco.MjData(chain.model) for _ in range(count)]
    turn = itertools.count()

    def step() -> None:
        for one, state in zip(data, tape[next(turn) % len(tape)], strict=True):
            mujoco.mj_setState(chain.model, one, state, STATE)
            mujoco.mj_step(chain.model, one, steps)

    return step


def floors() -> list[str]:
    """Return the same lines for what costs Python alone: hardly any physics, and none."""
    env = gym.make("Reacher-v5")
    env.reset(seed=0)
    torques = np.zeros(2, np.float32)
    base: Any = env.unwrapped
    ours = gym.make(ENV_ID, representation="clarke")
    ours.reset(seed=0)
    action = np.full(2, 0.01, np.float32)

    def reacher() -> None:
        if any(env.step(torques)[2:4]):
            env.reset()

    def constant_curvature() -> None:
        if any(ours.step(action)[2:4]):
            ours.reset()

    workloads: dict[str, Workload] = {
        "bare": lambda: mujoco.mj_step(base.model, base.data, base.frame_skip),
        "reacher": reacher,
        "constant": constant_curvature,
    }
    times = seconds_per_call(workloads, ROUNDS, 500)
    extra = 1e6 * (times["reacher"] - times["bare"])
    return [
        f"| Gymnasium's Reacher-v5 | | 1 | {times['bare'] / times['reacher']:.2f} | "
        f"| {extra:.1f} us a step |",
        f"| constant curvature | 1 | 1 | | | {1e6 * times['constant']:.1f} us the whole step |",
    ]


def overhead() -> list[str]:
    """Return lines about the environment's time over the bare loop's."""
    lines = floors()
    for profile in PROFILES:
        for segments in SEGMENTS:
            for count, bar in ((BATCH, 0.9), (1, 0.7)):
                workloads = {
                    "bare": bare(count, profile, segments),
                    "env": actor(count, profile, segments)[1],
                }
                short = profile == "fast"
                calls = (5 if short else 1) * (1 if count > 1 else 20)
                times = seconds_per_call(workloads, 5 * ROUNDS if short else ROUNDS, calls)
                ratio = times["bare"] / times["env"]
                extra = 1e6 * (times["env"] - times["bare"]) / count
                lines.append(
                    f"| {profile} | {segments} | {count} | {ratio:.2f} | {bar} "
                    f"| {extra:.1f} us a step |"
                )
    return lines


def draw(costs: dict[tuple[int, str], list[float]]) -> Figure:
    """Return the figure of microseconds a control step, by segments and "taut" or "slack"."""
    figure = Figure((6.5, 3.5))
    axis = figure.subplots()
    for (segments, kind), cost in costs.items():
        style = "o-" if kind == "taut" else "o:"
        noun = "segment" if segments == 1 else "segments"
        axis.plot(COUNTS, cost, style, color=f"C{segments}", label=f"{segments} {noun}, {kind}")
    axis.set(xlabel="tendons a segment", ylabel="us a control step", yscale="log")
    axis.grid(alpha=0.3)
    axis.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    figure.tight_layout()
    return figure


def main() -> None:
    """Measure, print and write a table and a figure."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics_speed")
    parser.add_argument("--out", type=Path, default=Path("docs/validation"), help="output folder")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    robots = {(s, n): make_robot(n_segments=s, n_tendons=n) for s in SEGMENTS for n in COUNTS}
    fast: dict[str, Workload] = {}
    accurate: dict[str, Workload] = {}
    for (s, n), robot in robots.items():
        fast[f"{s} {n} taut"] = moving(robot, 0.0)
        fast[f"{s} {n} slack"] = moving(robot, 2e-4)
        accurate[f"{s} {n} accurate"] = moving(robot, 0.0, profile="accurate")
    times = seconds_per_call(fast, ROUNDS, 8) | seconds_per_call(accurate, 3, 1)
    lines = [
        f"Control steps a second on one core, {1e3 * CONTROL_DT:g} ms control, batch {BATCH}, "
        "physics step with pose and displacement read.",
        "",
        "| segments | tendons a segment | fast, taut | over n = 3 | fast, slack | accurate |",
        "| ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    costs: dict[tuple[int, str], list[float]] = {}
    for s in SEGMENTS:
        for kind in ("taut", "slack"):
            costs[s, kind] = [1e6 * times[f"{s} {n} {kind}"] / BATCH for n in COUNTS]
        cost = costs[s, "taut"]
        for n, taut in zip(COUNTS, cost, strict=True):
            rates = [BATCH / times[f"{s} {n} {k}"] for k in ("taut", "slack", "accurate")]
            lines.append(
                f"| {s} | {n} | {rates[0]:,.0f} | {taut / cost[0]:.2f} "
                f"| {rates[1]:,.0f} | {rates[2]:,.0f} |"
            )
    draw(costs).savefig(out / "physics_speed.png", dpi=120)
    lines += [
        "",
        f"Bare `mj_step` loop over environment step (1 is as fast), {1e3 * ENV_DT:g} ms control.",
        "",
        "| profile | segments | batch | ratio | bar | over the bare loop |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
        *overhead(),
        "",
        f"Load average of the {os.cpu_count()} cores meanwhile: {os.getloadavg()[1]:.1f}.",
    ]
    table = "\n".join(lines) + "\n"
    print(table)
    (out / "physics_speed.md").write_text(table)


if __name__ == "__main__":
    main()
