"""Random steps of every task, undisturbed and harsh: docs/validation/task_soak.md.

python -m benchmarks.task_soak [--processes 2] [--tasks Hold Wrap] [--again]

Counts numbers that are not finite, observations outside their space, rewards outside [0, 1] and
diverged episodes; tells how deep robots get into bodies, in motion and at rest, and how far the
clearance that tasks look at is from a denser one. Steps run in pieces, each with a seed of its own,
which docs/results/measured/task_soak.json keeps as they end: what was interrupted goes on there
(all of it is some six hours of one core). `--again` forgets the pieces of the named tasks first.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import parse_env_id
from tqdm import tqdm

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import ROOT, write_text
from benchmarks.committed_scores import plain_table
from benchmarks.measured import FOLDER, keep, measured
from clarke_gym.physics.base import CLEARANCE_POINTS
from clarke_gym.registration import ENVIRONMENTS

PAGE = ROOT / "docs" / "validation" / "task_soak.md"
DATA = "task_soak"
TASKS = [parse_env_id(env_id)[1] for env_id, keywords in ENVIRONMENTS.items() if keywords]
BATCH = 64
STEPS = 1_048_576
PIECE = 65_536
"""Steps of a case, and of a piece of it."""
TOUCH_N = 1e-6

DENSE_POINTS, NEAR_M = 96, 2e-3
"""Points a segment that tell the true clearance; the looser one is held against it this near."""


Case: TypeAlias = tuple[str, str, str, str]
"""Id, physics, preset of disturbances and representation."""

Piece: TypeAlias = dict[str, Any]
"""What `soak` tells."""


def cases() -> dict[Case, int]:
    """Return the steps of every case.

    All steps in the physics that an id has by itself, with Clarke actions; a tenth on MuJoCo for
    the ids of both, and a 64th where their tendons go slack: the whole model in short time steps.
    """
    found: dict[Case, int] = {}
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords:
            continue
        own = keywords.get("physics")
        for model in [own] if own else ["constant_curvature", "mujoco"]:
            both = model == "mujoco" and own is None
            found[env_id, model, "none", "clarke"] = STEPS // 10 if both else STEPS
            found[env_id, model, "harsh", "clarke"] = STEPS // 64 if both else STEPS
            found[env_id, model, "none", "raw"] = STEPS // 64 if model == "mujoco" else STEPS
    return found


def soak(case: Case, steps: int, seed: int) -> Piece:
    """Return what went wrong in some random steps, and how deep robots got."""
    env_id, physics, preset, representation = case
    warnings.simplefilter("error")  # in every process
    threads: dict[str, Any] = {"threads": 1} if physics == "mujoco" else {}
    envs: Any = gym.make_vec(
        env_id,
        num_envs=BATCH,
        physics=physics,
        disturbances=preset,
        representation=representation,
        n_tendons=4,
        **threads,
    )
    rng, wrong, diverged, deep, resting = np.random.default_rng(seed), 0, 0, 0.0, 0.0
    near, over, most_over = 0, 0.0, 0.0
    envs.reset(seed=seed * BATCH)
    simulated = envs.unwrapped.physics
    still = np.zeros(envs.action_space.shape, np.float32)
    for k in range(steps // BATCH):
        rest = k % 25 >= 15  # ten steps without motion, so that a state at rest is seen, too
        action = still if rest else np.float32(rng.uniform(-1, 1, still.shape))
        observation, reward, _, _, info = envs.step(action)
        inside = envs.observation_space.contains(observation)
        fine = inside and np.isfinite(reward).all() and 0.0 <= reward.min() <= reward.max() <= 1.0
        wrong += not fine
        diverged += int(info["diverged"].sum())
        if "clearance_m" in info:
            gap = simulated.surroundings.clearance(simulated.backbone(DENSE_POINTS))
            close = np.abs(gap) < NEAR_M
            if close.any():
                excess = (simulated.state.clearance - gap)[close]
                near, over = near + excess.size, over + float(excess.sum())
                most_over = max(most_over, float(excess.max()))
            if physics == "mujoco":
                touching = simulated.state.contact_force > TOUCH_N
                depth = np.where(touching, -gap, 0.0)
                deep = max(deep, float(depth.max()))
                if k % 25 == 24:
                    resting = max(resting, float(depth.max()))
    envs.close()
    return {
        "id": env_id,
        "physics": physics,
        "disturbances": preset,
        "representation": representation,
        "seed": seed,
        "steps": steps // BATCH * BATCH,
        "wrong": wrong,
        "diverged": diverged,
        "deep_m": deep,
        "resting_m": resting,
        "near": near,
        "over_m": over,
        "most_over_m": most_over,
    }


def of_case(pieces: list[Piece], case: Case) -> list[Piece]:
    """Return the pieces of one case."""
    keys = ("id", "physics", "disturbances", "representation")
    return [piece for piece in pieces if tuple(piece[key] for key in keys) == case]


def missing(pieces: list[Piece], tasks: list[str]) -> Iterator[tuple[Case, int, int]]:
    """Yield case, steps and seed of every piece that has yet to run, the slowest first."""
    steps = cases()
    for case in sorted(steps, key=lambda case: (case[1] != "mujoco", case[2] != "harsh")):
        if parse_env_id(case[0])[1] not in tasks:
            continue
        ran = {piece["seed"] for piece in of_case(pieces, case)}
        for seed, begin in enumerate(range(0, steps[case], PIECE)):
            if seed not in ran:
                yield case, min(steps[case] - begin, PIECE), seed


def run(tasks: list[str], processes: int, again: bool) -> list[Piece]:
    """Run what has not run yet, keep it, and return all pieces."""
    pieces: list[Piece] = []
    if (FOLDER / f"{DATA}.json").exists():
        pieces += measured(DATA)["pieces"]
    if again:
        pieces = [piece for piece in pieces if parse_env_id(piece["id"])[1] not in tasks]
    with ProcessPoolExecutor(processes) as pool:
        running = [pool.submit(soak, *arguments) for arguments in missing(pieces, tasks)]
        for end in tqdm(as_completed(running), total=len(running), unit="piece"):
            pieces.append(end.result())
            keep(DATA, {"pieces": pieces})
    return pieces


def page(pieces: list[Piece]) -> str:
    """Return the page as Markdown."""
    rows, total = [_HEAD], 0
    for case in cases():
        ran = of_case(pieces, case)
        if not ran:
            continue
        steps, wrong, diverged, near, over = (
            sum(piece[key] for piece in ran)
            for key in ("steps", "wrong", "diverged", "near", "over_m")
        )
        deep, resting, most_over = (
            f"{1e3 * max(piece[key] for piece in ran):.2f}"
            for key in ("deep_m", "resting_m", "most_over_m")
        )
        row = [parse_env_id(case[0])[1], *case[1:], f"{steps:,}", str(wrong), str(diverged)]
        row += [deep, resting] if case[1] == "mujoco" and near else ["–", "–"]
        row += [f"{1e3 * over / near:.2f}", most_over] if near else ["–", "–"]
        rows.append(row)
        total += steps
    left = sum(steps for _, steps, _ in missing(pieces, TASKS))
    return _PAGE.format(
        total=total,
        unfinished=f"; {left:,} are yet to run" if left else "",
        batch=BATCH,
        points=CLEARANCE_POINTS,
        dense=DENSE_POINTS,
        near_mm=1e3 * NEAR_M,
        table=plain_table(rows),
    )


def main() -> None:
    """Run what is missing, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.task_soak")
    parser.add_argument("--tasks", nargs="+", choices=TASKS, default=TASKS)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--again", action="store_true", help="run these tasks' steps again")
    options = parser.parse_args()
    write_text(PAGE, page(run(options.tasks, options.processes, options.again)))


_HEAD = ["task", "physics", "disturbed", "action", "steps", "wrong", "diverged"]
_HEAD += ["depth", "rest", "over", "most over"]

_PAGE = """# Random steps of every task

{total:,} random environment steps (ten of 25 without motion, four tendons, batches of {batch}),
warnings as errors{unfinished}.
Wrong: steps with an observation outside its space, a number that is not finite or a reward outside
[0, 1]. Depth of the hull in a body [mm], worst of all steps and worst after half a second without a
new command, through which harsh pushes go on; MuJoCo alone, as constant curvature goes through
bodies. Tasks look at the clearance of {points} points a segment, this page's depths at {dense}: the
last two columns tell how much larger the former is than the latter [mm], in the mean and at most,
for robots within {near_mm:g} mm of touching. `python -m benchmarks.task_soak` writes this page.

{table}
"""


if __name__ == "__main__":
    main()
