"""Random steps of every task, undisturbed and harsh: docs/validation/task_soak.md.

python -m benchmarks.task_soak --steps 100000

Counts numbers that are not finite, observations outside their space, rewards outside [0, 1] and
diverged episodes; tells how deep robots get into bodies, in motion and at rest, and what a step
costs over Reach with the same robot and physics in the same run.
"""

from __future__ import annotations

import argparse
import time
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.registration import ENVIRONMENTS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "validation" / "task_soak.md"
BATCH = 64
TOUCH_N = 1e-6


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


def step_cost(env_id: str, physics: str, disturbances: str, batch: int, robot: str) -> float:
    """Return the median time of a batch's step [s]."""
    keywords: dict[str, Any] = {
        "physics": physics,
        "disturbances": disturbances,
        "robot": robot,
    }
    envs: Any = gym.make_vec(
        env_id, num_envs=batch, representation="clarke", n_tendons=4, **keywords
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [0.3 * envs.action_space.sample() for _ in range(60)]
    times = []
    for action in actions:
        begin = time.perf_counter()
        envs.step(action.astype(np.float32))
        times.append(time.perf_counter() - begin)
    envs.close()
    return float(np.median(times[10:]))


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--steps", type=int, default=100_000, help="environment steps a case")
    steps = parser.parse_args().steps
    warnings.simplefilter("error")
    rows, total = [], 0
    for env_id, physics, preset, representation in cases():
        count = (
            steps if physics == "constant_curvature" or representation == "clarke" else steps // 8
        )
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
    costs = []
    for env_id, keywords in ENVIRONMENTS.items():
        if not keywords:
            continue
        robot = keywords.get("robot", "default")
        for physics in (
            [keywords["physics"]]
            if "physics" in keywords
            else [
                "constant_curvature",
                "mujoco",
            ]
        ):
            for batch in (1, 64):
                ratios, harsh = [], []
                for _ in range(3):
                    base = step_cost("clarke_gym/Reach-v0", physics, "none", batch, robot)
                    own = step_cost(env_id, physics, "none", batch, robot)
                    ratios.append(own / base)
                    harsh.append(step_cost(env_id, physics, "harsh", batch, robot) / own)
                name = env_id.split("/")[1].removesuffix("-v0")
                costs.append(
                    f"| {name} | {physics} | {batch} | {np.median(ratios):.2f} | "
                    f"{np.median(harsh):.2f} |"
                )
                print(costs[-1], flush=True)
    PAGE.write_text(
        _TEXT.format(total=total, batch=BATCH, rows="\n".join(rows), costs="\n".join(costs)),
        encoding="utf-8",
    )


_TEXT = """# Random steps of every task

{total:,} random environment steps (ten of 25 without motion, four tendons, batches of {batch}),
warnings as errors. Wrong: steps with an observation outside its space, a number that is not finite
or a reward outside [0, 1]. Depth of the hull in a body [mm], worst of all steps and worst after
half a second without motion; MuJoCo alone, as constant curvature goes through bodies.
`python -m benchmarks.task_soak` writes this page.

| task | physics | disturbances | actions | steps | wrong | diverged | depth | at rest |
|---|---|---|---|---|---|---|---|---|
{rows}

## What a step costs

Over Reach with the same robot, physics and batch; then `harsh` over `none`. Medians of three
ratios, measured side by side.

| task | physics | batch | over Reach | harsh over none |
|---|---|---|---|---|
{costs}
"""


if __name__ == "__main__":
    main()
