"""Random steps of every task, undisturbed and harsh: docs/validation/task_soak.md.

python -m benchmarks.task_soak
python -m benchmarks.task_soak --part disturbances

Counts numbers that are not finite, observations outside their space, rewards outside [0, 1] and
diverged episodes; tells how deep robots get into bodies, in motion and at rest, and what a step
costs over Reach with the same robot and physics in the same run, and with disturbances over the
same robot without. `--part` measures one of the page's parts again.
"""

from __future__ import annotations

import argparse
import time
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.registration import ENVIRONMENTS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "validation" / "task_soak.md"
BATCH = 64
TOUCH_N = 1e-6

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

PARTS = ("soak", "arcs", "mujoco", "disturbances")
"""Parts of the page, in its order."""

WHOLE = "whole"
"""Profile that simulates all tendons at every step, in the time steps that slack ones need."""


def cases() -> list[tuple[str, str, str, str]]:
    """Return id, physics, preset and representation of every case."""
    found = []
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords:
            continue
        physics = [keywords["physics"]] if "physics" in keywords else None
        for model in physics or ["constant_curvature", "mujoco"]:
            for preset in ("none", "harsh"):
                found.append((env_id, model, preset, "clarke"))
            found.append((env_id, model, "none", "raw"))
    return found


def soak(env_id: str, physics: str, preset: str, representation: str, steps: int) -> dict[str, Any]:
    """Return what went wrong in some random steps, and how deep robots got."""
    envs: Any = gym.make_vec(
        env_id,
        num_envs=BATCH,
        physics=physics,
        disturbances=preset,
        representation=representation,
        n_tendons=4,
    )
    rng, wrong, diverged, deep, resting = np.random.default_rng(0), 0, 0, 0.0, 0.0
    envs.reset(seed=0)
    state = envs.unwrapped.physics
    still = np.zeros(envs.action_space.shape, np.float32)
    for k in range(steps // BATCH):
        rest = k % 25 >= 15  # ten steps without motion, so that a state at rest is seen, too
        action = still if rest else np.float32(rng.uniform(-1, 1, still.shape))
        observation, reward, _, _, info = envs.step(action)
        inside = envs.observation_space.contains(observation)
        fine = inside and np.isfinite(reward).all() and 0.0 <= reward.min() <= reward.max() <= 1.0
        wrong += not fine
        diverged += int(info["diverged"].sum())
        if "clearance_m" in info and physics == "mujoco":
            touching = state.state.contact_force > TOUCH_N
            depth = np.where(touching, -info["clearance_m"], 0.0)
            deep = max(deep, float(depth.max()))
            if k % 25 == 24:
                resting = max(resting, float(depth.max()))
    envs.close()
    return {"wrong": wrong, "diverged": diverged, "deep": deep, "resting": resting}


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


def soaked(steps: int) -> str:
    """Return the part of the page that tells what went wrong."""
    rows, total = [], 0
    for env_id, physics, preset, representation in cases():
        slow = preset == "harsh" or representation == "raw"  # slack tendons: the whole model
        count = steps // (1 if physics == "constant_curvature" else 64 if slow else 10)
        found = soak(env_id, physics, preset, representation, count)
        total += count // BATCH * BATCH
        depths = "– | –"
        if found["deep"] > 0.0:
            depths = f"{1e3 * found['deep']:.2f} | {1e3 * found['resting']:.2f}"
        name = env_id.split("/")[1].removesuffix("-v0")
        rows.append(
            f"| {name} | {physics} | {preset} | {representation} | {count // BATCH * BATCH:,} | "
            f"{found['wrong']} | {found['diverged']} | {depths} |"
        )
        print(rows[-1], flush=True)
    return _SOAKED.format(total=total, batch=BATCH, rows="\n".join(rows))


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
            name = env_id.split("/")[1].removesuffix("-v0")
            costs.append(f"| {name} | {batch} | {np.median(ratios):.2f} | {np.median(harsh):.2f} |")
            print(costs[-1], flush=True)
    return _COSTS.format(physics=physics, rows="\n".join(costs))


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
    parser.add_argument(
        "--steps",
        type=int,
        default=1_048_576,
        help="environment steps a case; a tenth on MuJoCo, a 64th where its tendons go slack",
    )
    parser.add_argument("--part", choices=PARTS, help="one part alone")
    arguments = parser.parse_args()
    warnings.simplefilter("error")
    measured = {
        "soak": lambda: soaked(arguments.steps),
        "arcs": lambda: step_costs("constant_curvature"),
        "mujoco": lambda: step_costs("mujoco"),
        "disturbances": disturbance_costs,
    }
    kept = PAGE.read_text(encoding="utf-8").split("\n## ") if arguments.part else []
    parts = []
    for k, (name, measure) in enumerate(measured.items()):
        if arguments.part in (None, name):
            parts.append(measure().strip())
        elif k < len(kept):
            parts.append(kept[k].strip())
    PAGE.write_text("\n\n## ".join(parts) + "\n", encoding="utf-8")


_SOAKED = """# Random steps of every task

{total:,} random environment steps (ten of 25 without motion, four tendons, batches of {batch}),
warnings as errors. Wrong: steps with an observation outside its space, a number that is not finite
or a reward outside [0, 1]. Depth of the hull in a body [mm], worst of all steps and worst after
half a second without motion; MuJoCo alone, as constant curvature goes through bodies.
`python -m benchmarks.task_soak` writes this page.

| task | physics | disturbances | actions | steps | wrong | diverged | depth | at rest |
|---|---|---|---|---|---|---|---|---|
{rows}
"""

_COSTS = """What a step costs, {physics}

Over Reach with the same robot and batch; then `harsh` over `none`. Medians of three ratios of CPU
times, measured side by side; the rows of Reach over itself show how far they scatter.

| task | batch | over Reach | harsh over none |
|---|---|---|---|
{rows}
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
