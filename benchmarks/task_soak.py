"""Random steps of every task, undisturbed and harsh: docs/validation/task_soak.md.

python -m benchmarks.task_soak
python -m benchmarks.task_soak --part disturbances
python -m benchmarks.task_soak --part soak --processes 2 --tasks Hold Wrap

Counts numbers that are not finite, observations outside their space, rewards outside [0, 1] and
diverged episodes; tells how deep robots get into bodies, in motion and at rest, and what a step
costs over Reach with the same robot and physics in the same run, and with disturbances over the
same robot without. `--part` measures one of the page's parts again.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

import clarke_gym  # noqa: F401  (registers the environments)
from benchmarks.measured import FOLDER, keep, measured
from clarke_gym.physics.base import CLEARANCE_POINTS
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.registration import ENVIRONMENTS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "validation" / "task_soak.md"
BATCH = 64
STEPS = 1_048_576
PIECE = 65_536
"""Steps of a case, and of a piece of it."""
TOUCH_N = 1e-6
MEASURED = 10
"""Numbers that Reach's sensors measure of four tendons: displacements, the tip, the goal's gap."""

DENSE_POINTS, NEAR_M = 96, 2e-3
"""Points a segment that tell the true clearance; the looser one is held against it this near."""

DISTURBED = (
    "payload",
    "sensor_noise",
    "backlash",
    "misplacement",
    "tendon_stiffness",
    "pretension",
    "broken_tendon",
    "capstan",
    "mild",
    "hardware",
    "harsh",
)
"""Disturbances and presets whose cost is told."""

PARTS = ("soak", "arcs", "added", "mujoco", "disturbances")
"""Parts of the page, in its order."""

WHOLE = "whole"
"""Profile that simulates all tendons at every step, in the time steps that slack ones need."""


def name_of(env_id: str) -> str:
    """Return a task's name in an id."""
    return env_id.split("/")[1].removesuffix("-v0")


def cases() -> list[tuple[str, str, str, str, int]]:
    """Return id, physics, preset, representation and steps of every case.

    All steps in the physics that an id has by itself, with Clarke actions; a tenth on MuJoCo for
    the ids of both, and a 64th where their tendons go slack: the whole model in short time steps.
    """
    found = []
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords:
            continue
        own = keywords.get("physics")
        for model in [own] if own else ["constant_curvature", "mujoco"]:
            both = model == "mujoco" and own is None
            found.append((env_id, model, "none", "clarke", STEPS // 10 if both else STEPS))
            found.append((env_id, model, "harsh", "clarke", STEPS // 64 if both else STEPS))
            slack = model == "mujoco"
            found.append((env_id, model, "none", "raw", STEPS // 64 if slack else STEPS))
    return found


def soak(
    env_id: str, physics: str, preset: str, representation: str, steps: int, seed: int
) -> dict[str, Any]:
    """Return what went wrong in some random steps, and how deep robots got."""
    warnings.simplefilter("error")
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


def of_case(pieces: list[dict[str, Any]], case: tuple[str, str, str, str]) -> list[dict[str, Any]]:
    """Return the pieces of one case."""
    keys = ("id", "physics", "disturbances", "representation")
    return [piece for piece in pieces if tuple(piece[key] for key in keys) == case]


def missing(pieces: list[dict[str, Any]], tasks: list[str]) -> Iterator[tuple[Any, ...]]:
    """Yield the arguments of `soak` for every piece that has yet to run, the slowest first."""
    slowest_first = sorted(cases(), key=lambda case: (case[1] != "mujoco", case[2] != "harsh"))
    for env_id, physics, preset, representation, steps in slowest_first:
        if name_of(env_id) not in tasks:
            continue
        case = (env_id, physics, preset, representation)
        ran = {piece["seed"] for piece in of_case(pieces, case)}
        for seed, begin in enumerate(range(0, steps, PIECE)):
            if seed not in ran:
                yield (*case, min(steps - begin, PIECE), seed)


def step_cost(
    env_id: str,
    physics: str,
    disturbances: str,
    batch: int,
    robot: str,
    steps: int = 60,
    **keywords: Any,
) -> float:
    """Return the median CPU time of a batch's step [s]: other work on the machine has no part."""
    keywords |= {
        "physics": physics,
        "disturbances": disturbances,
        "robot": robot,
    }
    envs: Any = gym.make_vec(
        env_id, num_envs=batch, representation="clarke", n_tendons=4, **keywords
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [0.3 * envs.action_space.sample() for _ in range(steps)]
    times = []
    for action in actions:
        begin = time.process_time()
        envs.step(action.astype(np.float32))
        times.append(time.process_time() - begin)
    envs.close()
    return float(np.median(times[steps // 6 :]))


def soaked(tasks: list[str], processes: int, again: bool) -> str:
    """Run what has not run yet; return the part of the page that tells what went wrong."""
    pieces: list[dict[str, Any]] = []
    if (FOLDER / "task_soak.json").exists():
        pieces = measured("task_soak")["pieces"]
    if again:
        pieces = [piece for piece in pieces if name_of(piece["id"]) not in tasks]
    with ProcessPoolExecutor(processes) as pool:
        running = [pool.submit(soak, *arguments) for arguments in missing(pieces, tasks)]
        for end in tqdm(as_completed(running), total=len(running), unit="piece"):
            pieces.append(end.result())
            keep("task_soak", {"pieces": pieces})
    return soak_table(pieces)


def soak_table(pieces: list[dict[str, Any]]) -> str:
    """Return the part of the page that tells what went wrong in the pieces that have run."""
    rows, total = [], 0
    for *case, _ in cases():
        ran = of_case(pieces, (case[0], case[1], case[2], case[3]))
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
        depths = [deep, resting] if case[1] == "mujoco" and near else ["–", "–"]
        excess = [f"{1e3 * over / near:.2f}", most_over] if near else ["–", "–"]
        cells = [name_of(case[0]), *case[1:], f"{steps:,}", wrong, diverged, *depths, *excess]
        rows.append("| " + " | ".join(map(str, cells)) + " |")
        total += steps
    left = sum(steps for *_, steps, _ in missing(pieces, [name_of(case[0]) for case in cases()]))
    unfinished = f"; {left:,} are yet to run" if left else ""
    return _SOAKED.format(
        total=total,
        unfinished=unfinished,
        batch=BATCH,
        points=CLEARANCE_POINTS,
        dense=DENSE_POINTS,
        near_mm=1e3 * NEAR_M,
        rows="\n".join(rows),
    )


def step_costs(physics: str) -> str:
    """Return the part of the page that tells what a step costs over Reach."""
    costs = []
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords or keywords.get("physics", physics) != physics:
            continue
        robot = keywords.get("robot", "default")
        for batch in (1, 64):
            ratios, harsh = [], []
            for _ in range(3):
                base = step_cost("clarke_gym/Reach-v0", physics, "none", batch, robot)
                own = step_cost(env_id, physics, "none", batch, robot)
                ratios.append(own / base)
                harsh.append(step_cost(env_id, physics, "harsh", batch, robot) / own)
            cells = [name_of(env_id), batch, f"{np.median(ratios):.2f}", f"{np.median(harsh):.2f}"]
            costs.append("| " + " | ".join(map(str, cells)) + " |")
            print(costs[-1], flush=True)
    return _COSTS.format(physics=physics, rows="\n".join(costs))


def cpu_time(work: Callable[[], object], times: int = 60) -> float:
    """Return the median CPU time of some work [s]."""
    took = []
    for _ in range(times):
        begin = time.process_time()
        work()
        took.append(time.process_time() - begin)
    return float(np.median(took))


def added_costs() -> str:
    """Return the part of the page that tells what bodies and noise add to a step by themselves."""
    rows, noise = [], []
    for batch in (1, 64, 4096):
        for name in ("Gate", "Nest"):
            env_id = f"clarke_gym/{name}-v0"
            envs: Any = gym.make_vec(env_id, num_envs=batch, n_tendons=4)
            envs.reset(seed=0)
            model = envs.unwrapped.physics
            curve = model.backbone(CLEARANCE_POINTS)
            parts = (
                partial(model.backbone, CLEARANCE_POINTS),
                partial(model.surroundings.clearance, curve),
            )
            points, gaps = _shares(parts, batch, ENVIRONMENTS[env_id].get("robot", "default"))
            size = f"{curve.shape[1]} x {model.surroundings.numbers.shape[1]}"
            cells = [name, size, batch, *(f"{x:.2f}" for x in (points, gaps, points + gaps))]
            rows.append("| " + " | ".join(map(str, cells)) + " |")
            print(rows[-1], flush=True)
        normal = np.random.default_rng(0).standard_normal
        drawn = partial(normal, out=np.empty((batch, MEASURED)))
        noise += [f"{share:.2f}" for share in _shares((drawn,), batch, "default")]
    print(noise, flush=True)
    return _ADDED.format(rows="\n".join(rows), measured=MEASURED, noise=" / ".join(noise))


def _shares(
    parts: Sequence[Callable[[], object]], batch: int, robot: str
) -> NDArray[np.floating[Any]]:
    """Return the CPU times of some work over that of a step of Reach, medians of five ratios."""
    found = []
    for _ in range(5):
        reach = step_cost("clarke_gym/Reach-v0", "constant_curvature", "none", batch, robot)
        found.append([cpu_time(part) / reach for part in parts])
    shares: NDArray[np.floating[Any]] = np.median(found, axis=0)
    return shares


def disturbance_costs() -> str:
    """Return the part of the page that tells what disturbances cost on MuJoCo."""
    fast = PROFILES["fast"]
    PROFILES[WHOLE] = replace(fast, folded=False, sim_dt_s=fast.slack_dt_s)
    batches, rows = (1, 8), []
    ratios: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for batch in batches:
        for _ in range(3):

            def cost(name: str, batch: int = batch, **keywords: Any) -> float:
                steps = 24
                reach = "clarke_gym/Reach-v0"
                return step_cost(reach, "mujoco", name, batch, "default", steps, **keywords)

            folded, whole = cost("none"), cost("none", profile=WHOLE)
            ratios.setdefault((WHOLE, batch), []).append((whole / folded, 1.0))
            for name in DISTURBED:
                own = cost(name)
                ratios.setdefault((name, batch), []).append((own / folded, own / whole))
    for name in (WHOLE, *DISTURBED):
        cells = [
            f"{over:.2f}" for batch in batches for over in np.median(ratios[name, batch], axis=0)
        ]
        label = "none, whole" if name == WHOLE else f"`{name}`"
        rows.append(f"| {label} | " + " | ".join(cells) + " |")
        print(rows[-1], flush=True)
    del PROFILES[WHOLE]
    return _DISTURBED.format(rows="\n".join(rows), slack_ms=1e3 * fast.slack_dt_s)


def main() -> None:
    """Write the page, or one of its parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--part", choices=PARTS, help="one part alone")
    names = [name_of(env_id) for env_id, keywords in ENVIRONMENTS.items() if keywords]
    parser.add_argument("--tasks", nargs="+", choices=names, default=names, help="of the soak")
    parser.add_argument("--processes", type=int, default=1, help="of the soak")
    parser.add_argument("--again", action="store_true", help="run these tasks' steps again")
    options = parser.parse_args()
    warnings.simplefilter("error")
    measures = {
        "soak": lambda: soaked(options.tasks, options.processes, options.again),
        "arcs": lambda: step_costs("constant_curvature"),
        "added": added_costs,
        "mujoco": lambda: step_costs("mujoco"),
        "disturbances": disturbance_costs,
    }
    kept = PAGE.read_text(encoding="utf-8").split("\n## ") if options.part else []
    parts = []
    for k, (name, measure) in enumerate(measures.items()):
        if options.part in (None, name):
            parts.append(measure().strip())
        elif k < len(kept):
            parts.append(kept[k].strip())
    PAGE.write_text("\n\n## ".join(parts) + "\n", encoding="utf-8")


_SOAKED = """# Random steps of every task

{total:,} random environment steps (ten of 25 without motion, four tendons, batches of {batch}),
warnings as errors{unfinished}.
Wrong: steps with an observation outside its space, a number that is not finite or a reward outside
[0, 1]. Depth of the hull in a body [mm], worst of all steps and worst after half a second without a
new command, through which harsh pushes go on; MuJoCo alone, as constant curvature goes through
bodies. Tasks look at the clearance of {points} points a segment, this page's depths at {dense}: the
last two columns tell how much larger the former is than the latter [mm], in the mean and at most,
for robots within {near_mm:g} mm of touching. `python -m benchmarks.task_soak` writes this page.

| task | physics | disturbed | action | steps | wrong | diverged | depth | rest | over | most over |
|---|---|---|---|---|---|---|---|---|---|---|
{rows}
"""

_COSTS = """What a step costs, {physics}

Over Reach with the same robot and batch; then `harsh` over `none`. Medians of three ratios of CPU
times, measured side by side; the rows of Reach over itself show how far they scatter.

| task | batch | over Reach | harsh over none |
|---|---|---|---|
{rows}
"""

_ADDED = """What bodies and noise add, constant curvature

The calls that give the points along a robot and their clearance from its bodies, by themselves,
over a whole step of Reach with the same robot and batch; medians of five ratios of CPU times. For a
step among bodies to cost 1.6 times Reach's, together they would have to stay below 0.6, with
nothing for rewards, metrics and sensors.

| task | points x bodies | batch | points | clearance | together |
|---|---|---|---|---|---|
{rows}

Each pair of point and body is one product of a point's numbers with a body's; passes over one
coordinate at a time take half as long again, or twice as long. For a step with noise to cost 1.15
times one without, {measured} normal numbers a robot, drawn by NumPy in one call for all of them
(n = 4), would have to stay below 0.15: they are {noise} of a step in batches of 1 / 64 / 4096, and
noise that each environment can repeat by itself costs more.
"""

_DISTURBED = """What disturbances cost on MuJoCo

Reach, four tendons, over the same robot undisturbed: as it is simulated (two virtual tendons stand
for the taut ones, time steps of 5 ms), and with all its tendons in the time steps of
{slack_ms:g} ms that slack ones need ("whole"), which is what a model without folding always pays.
Medians of three ratios of CPU times, measured side by side.

Disturbances that leave tendons taut cost little. One that lets a tendon go slack, break or stick
makes those control steps whole ones, whose time is the engine's: `pretension` and `misplacement`
(tendons strained against each other) where one is slack, `broken_tendon` and `capstan` always.

| disturbances | batch 1, over folded | over whole | batch 8, over folded | over whole |
|---|---|---|---|---|
{rows}
"""


if __name__ == "__main__":
    main()
