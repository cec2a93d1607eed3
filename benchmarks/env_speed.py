"""Speed of the environments against Gymnasium's own, as ratios inside one run.

python -m benchmarks.env_speed

docs/results/measured/env_speed.json keeps what was found.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import itertools
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from benchmarks.measured import keep
from benchmarks.timing import Workload, seconds_per_call

ID = "clarke_gym/Reach-v0"
BATCH = 4096


def vector(env_id: str, batch: int, **keywords: Any) -> Workload:
    """Return one step of a batch in mid-life: episodes end at different times, resets included."""
    envs = gym.make_vec(env_id, num_envs=batch, vectorization_mode="vector_entry_point", **keywords)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = envs.action_space.sample()
    core = getattr(envs.unwrapped, "_core", None)
    if core is not None:
        core.episode.steps[:] = np.arange(batch) % 50
    else:
        for _ in range(60):
            envs.step(actions)
    return lambda: envs.step(actions)


def scalar(env_id: str, **keywords: Any) -> Workload:
    """Return one step of a scalar environment, resets at the time limit included."""
    env = gym.make(env_id, **keywords)
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(64)]
    count = 0

    def step() -> None:
        nonlocal count
        count += 1
        _, _, terminated, truncated, _ = env.step(actions[count % 64])
        if terminated or truncated:
            env.reset()

    return step


STAGES = ("limits", "physics", "task", "sensors", "rest")
"""What a step passes through: an action becomes a command, the robot moves, the task evaluates it
and tells `info`, sensors observe; the rest is the environment's own and Gymnasium's."""


def stages(env: Any) -> dict[str, Workload]:
    """Return steps of an environment that end after the first stage, after the second, and so on.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        As `gymnasium.make` returns it.
    """
    env.reset(seed=0)
    env.action_space.seed(0)
    action, core = env.action_space.sample(), env.unwrapped._core  # a stopwatch has to look inside

    def limits() -> None:
        core._command = core.limits.apply(core.actions.read(action), core._command)

    def physics() -> None:
        limits()
        core.physics.step(core._command)
        assert core.physics.state is not None

    def task() -> None:
        physics()
        core.evaluate()

    def sensors() -> None:
        task()
        core.observe()

    def whole() -> None:
        core.episode.steps[:] = 1  # no episode ends
        env.step(action)

    return dict(zip(STAGES, [limits, physics, task, sensors, whole], strict=True))


def shares(env: Any, calls: int) -> dict[str, float]:
    """Return which share of a step each stage takes."""
    spent = seconds_per_call(stages(env), rounds=25, calls=calls)
    ends = [0.0, *spent.values()]
    parts = [max(0.0, b - a) for a, b in itertools.pairwise(ends)]
    return {name: round(part / sum(parts), 3) for name, part in zip(STAGES, parts, strict=True)}


def main() -> None:
    """Print every ratio with its bar."""
    steps: dict[str, Workload] = {
        "cartpole": vector("CartPole-v1", BATCH),
        "clarke n=7": vector(ID, BATCH, n_tendons=7, representation="clarke"),
        "clarke n=3": vector(ID, BATCH, n_tendons=3, representation="clarke"),
        "clarke n=32": vector(ID, BATCH, n_tendons=32, representation="clarke"),
        "raw n=3": vector(ID, BATCH, n_tendons=3),
        "raw n=32": vector(ID, BATCH, n_tendons=32),
        "raw n=3, batch 32": vector(ID, 32, n_tendons=3),
        "raw n=32, batch 32": vector(ID, 32, n_tendons=32),
    }
    t = seconds_per_call(steps, rounds=25, calls=20)
    single = {
        "reacher": scalar("Reacher-v5"),
        "raw n=3": scalar(ID, n_tendons=3),
        "raw n=7": scalar(ID, n_tendons=7),
        "clarke n=7": scalar(ID, n_tendons=7, representation="clarke"),
    }
    s = seconds_per_call(single, rounds=25, calls=400)
    print(f"vector step, batch {BATCH}, autoreset included, one thread, median of 25 rounds")
    for name, value in t.items():
        print(f"  {name:20s} {value * 1e6:8.0f} us")
    print("scalar env.step, autoreset included")
    for name, value in s.items():
        print(f"  {name:20s} {value * 1e6:8.1f} us")
    rows = {
        "vector Clarke over CartPole-v1": (t["cartpole"] / t["clarke n=7"], ">= 0.5"),
        "scalar raw n = 3 over Reacher-v5": (s["reacher"] / s["raw n=3"], ">= 1"),
        "scalar raw n = 7 over Reacher-v5": (s["reacher"] / s["raw n=7"], ">= 1"),
        "scalar Clarke over Reacher-v5": (s["reacher"] / s["clarke n=7"], ">= 1.3"),
        "cost Clarke n = 32 over 3": (t["clarke n=32"] / t["clarke n=3"], "<= 1.5"),
        "cost raw n = 32 over 3": (t["raw n=32"] / t["raw n=3"], "<= 3"),
        "cost raw n = 32 over 3, batch 32": (
            t["raw n=32, batch 32"] / t["raw n=3, batch 32"],
            "<= 1.5",
        ),
    }
    print("speed ratios (bar)")
    for name, (ratio, bar) in rows.items():
        print(f"  {name:36s} {ratio:6.2f}   {bar}")
    where = {
        "scalar, Clarke n = 7": shares(gym.make(ID, n_tendons=7, representation="clarke"), 400),
        "scalar, raw n = 7": shares(gym.make(ID, n_tendons=7), 400),
    }
    for name, keywords in (
        ("Clarke n = 7", {"n_tendons": 7, "representation": "clarke"}),
        ("raw n = 3", {"n_tendons": 3}),
        ("raw n = 32", {"n_tendons": 32}),
    ):
        mode = "vector_entry_point"
        envs = gym.make_vec(ID, num_envs=BATCH, vectorization_mode=mode, **keywords)
        where[f"batch of {BATCH}, {name}"] = shares(envs, 20)
    print("where a step's time goes")
    for name, parts in where.items():
        print(f"  {name:28s}", parts)
    keep(
        "env_speed",
        {
            "ratios": {name: round(ratio, 3) for name, (ratio, _) in rows.items()},
            "vector_step_us": {name: round(1e6 * value, 1) for name, value in t.items()},
            "scalar_step_us": {name: round(1e6 * value, 2) for name, value in s.items()},
            "batch": BATCH,
            "shares": where,
        },
    )


if __name__ == "__main__":
    main()
