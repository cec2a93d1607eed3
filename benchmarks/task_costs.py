"""What a step of every task costs, and what disturbances add: docs/validation/task_costs.md.

python -m benchmarks.task_costs [--part added]

Over Reach with the same robot and physics in the same run, with disturbances over the same robot
without, and what bodies and noise add by themselves. `--part` measures one of the page's parts.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import parse_env_id
from numpy.typing import NDArray

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import ROOT, write_text
from clarke_gym.physics.base import CLEARANCE_POINTS
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.registration import ENVIRONMENTS
from clarke_gym.sensors import SENSORS

PAGE = ROOT / "docs" / "validation" / "task_costs.md"

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

WHOLE = "whole"
"""Profile that simulates all tendons at every step, in the time steps that slack ones need."""


STEPS = {"constant_curvature": 16 * 51, "mujoco": 2 * 51}
"""Steps that are measured: some of Reach's episodes, of 50 steps and a reset, which come in 16."""

ROUNDS = {"constant_curvature": 7, "mujoco": 3}
"""Times that they are measured."""


def cpu_times(work: Callable[[], object], times: int = 60) -> NDArray[np.float64]:
    """Return the CPU times of some work [s], after a fifth more, which warms up."""
    warming = times // 5
    took = []
    for _ in range(warming + times):
        begin = time.process_time()
        work()
        took.append(time.process_time() - begin)
    return np.array(took[warming:])


def step_times(
    env_id: str,
    physics: str,
    disturbances: str,
    batch: int,
    robot: str,
    steps: int = 60,
    **keywords: Any,
) -> NDArray[np.float64]:
    """Return the CPU times of a batch's steps [s]: other work on the machine has no part."""
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
    actions = cycle([np.float32(0.3 * envs.action_space.sample()) for _ in range(steps)])
    times = cpu_times(lambda: envs.step(next(actions)), steps)
    envs.close()
    return times


def step_costs(physics: str) -> str:
    """Return the part of the page that tells what a step costs over Reach."""
    costs = []
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords or keywords.get("physics", physics) != physics:
            continue
        robot = keywords.get("robot", "default")
        for batch in (1, 64):
            ratios = []
            for _ in range(ROUNDS[physics]):
                base, own, harsh = (
                    step_times(name, physics, disturbances, batch, robot, STEPS[physics])
                    for name, disturbances in (
                        ("clarke_gym/Reach-v0", "none"),
                        (env_id, "none"),
                        (env_id, "harsh"),
                    )
                )
                step, reach = np.median(own), np.median(base)
                ratios.append((step / reach, own.mean() / base.mean(), np.median(harsh) / step))
            medians = [f"{ratio:.2f}" for ratio in np.median(ratios, axis=0)]
            cells = [parse_env_id(env_id)[1], batch, *medians]
            costs.append("| " + " | ".join(map(str, cells)) + " |")
            print(costs[-1], flush=True)
    rows, steps, rounds = "\n".join(costs), STEPS[physics], ROUNDS[physics]
    return _COSTS.format(physics=physics, steps=steps, rounds=rounds, rows=rows)


def added_costs() -> str:
    """Return the part of the page that tells what bodies and noise add to a step by themselves."""
    rows, noise, count = [], [], measured_numbers()
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
        drawn = partial(normal, out=np.empty((batch, count)))
        noise += [f"{share:.2f}" for share in _shares((drawn,), batch, "default")]
    print(noise, flush=True)
    return _ADDED.format(rows="\n".join(rows), measured=count, noise=" / ".join(noise))


def measured_numbers() -> int:
    """Return how many numbers the sensors of Reach measure of a robot with four tendons."""
    blocks = gym.make("clarke_gym/Reach-v0", n_tendons=4).unwrapped.sensors  # type: ignore[attr-defined]
    return sum(len(blocks[name].labels) for name in blocks if SENSORS[name].measured)


def _shares(
    parts: Sequence[Callable[[], object]], batch: int, robot: str
) -> NDArray[np.floating[Any]]:
    """Return the CPU times of some work over that of a step of Reach, medians of five ratios."""
    found = []
    for _ in range(5):
        reach = step_times("clarke_gym/Reach-v0", "constant_curvature", "none", batch, robot)
        found.append([np.median(cpu_times(part)) / np.median(reach) for part in parts])
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
                times = step_times(reach, "mujoco", name, batch, "default", steps, **keywords)
                return float(np.median(times))

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


PARTS: dict[str, Callable[[], str]] = {
    "arcs": partial(step_costs, "constant_curvature"),
    "added": added_costs,
    "mujoco": partial(step_costs, "mujoco"),
    "disturbances": disturbance_costs,
}
"""Parts of the page, in its order."""


def main() -> None:
    """Write the page, or one of its parts."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.task_costs")
    parser.add_argument("--part", choices=list(PARTS), help="one part alone")
    only = parser.parse_args().part
    warnings.simplefilter("error")
    kept = PAGE.read_text(encoding="utf-8").split("\n## ")[1:] if only else []
    parts = [_HEAD]
    for k, (name, measure) in enumerate(PARTS.items()):
        parts.append(measure() if only in (None, name) else kept[k])
    write_text(PAGE, "\n\n## ".join(part.strip() for part in parts) + "\n")


_HEAD = """# What tasks and disturbances cost

`python -m benchmarks.task_costs` writes this page."""

_COSTS = """What a step costs, {physics}

CPU time over Reach's with the same robot and batch, the median of {steps} steps, and their mean,
which has part in what comes now and then: resets, paths told ahead and, over hundreds of steps,
episodes that are prepared in advance.
Then the median step under `harsh` over that under `none`. Medians of {rounds} ratios, measured side
by side; the rows of Reach over itself show how far they scatter.

| task | batch | median step | mean, with resets | harsh over none |
|---|---|---|---|---|
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

For a step with noise to cost 1.15 times one without, {measured} normal numbers a robot (n = 4),
drawn by NumPy in one call for all of them, would have to stay below 0.15: they are
{noise} of a step in batches of 1 / 64 / 4096, and noise that each environment can
repeat by itself costs more.
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
