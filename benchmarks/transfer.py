"""Policies of a finished study on robots that they were not trained on, without any change.

python -m benchmarks.transfer [--study runs/quick] [--goals 100] [--out docs/results/quick]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from agents.files import write_text
from agents.learning.acting import load_agent
from agents.learning.config import EnvSettings, TrainConfig, load_config
from agents.learning.evaluation import Agent, HeldOutEvaluation
from agents.reporting.loading import load_study
from agents.reporting.results import Arm
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.representations import make_representation
from clarke_gym.robots.presets import make_robot

COUNTS = (3, 4, 7, 11, 32)
PHYSICS = ("constant_curvature", "mujoco")


class BehindClarke:
    """A policy of raw tendon space that reads and writes Clarke coordinates of any robot.

    Parameters
    ----------
    agent : Agent
        Of a robot with one segment of `trained` tendons.
    trained : int
    env : gymnasium.vector.VectorEnv
        In Clarke coordinates, with any number of tendons.
    """

    def __init__(self, agent: Agent, trained: int, env: Any) -> None:
        self._agent = agent
        self._raw = make_representation("clarke", make_robot(n_tendons=trained))
        self._blocks = sum(block.reach is not None for block in env.unwrapped.sensors.values())

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions in Clarke coordinates, as short as the robot's speed limit makes them."""
        rows, width = len(observation), 2 * self._blocks
        joints = self._raw.decode(observation[:, :width].reshape(rows, self._blocks, 2))
        seen = np.concatenate([joints.reshape(rows, -1), observation[:, width:]], axis=1)
        action = self._raw.encode(np.clip(self._agent.act(seen.astype(np.float32)), -1.0, 1.0))
        return action / np.maximum(1.0, np.linalg.norm(action, axis=1, keepdims=True))


def results(
    arm: Arm, keywords: dict[str, bool | int | float | str], goals: int, adapted: bool
) -> FloatArray:
    """Return success rate and median tip error [mm] of each finished run, shape (runs, 2)."""
    rows = []
    if adapted:
        keywords = keywords | {"representation": "clarke"}
    for run, _ in arm.done:
        config = load_config(TrainConfig, run.path / "config.yaml")
        settings = EnvSettings(id=config.env.id, kwargs=config.env.kwargs | keywords)
        evaluation = HeldOutEvaluation(settings, goals)
        agent = load_agent(run.path, config, "policy", evaluation.env)
        if adapted:
            agent = BehindClarke(agent, int(config.env.kwargs["n_tendons"]), evaluation.env)
        found = evaluation.run(agent)
        evaluation.close()
        rows.append((found["is_success"].mean(), 1e3 * np.median(found["tip_error_m"])))
    return np.array(rows)


def main() -> None:
    """Evaluate every arm where its actions fit; print and write a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.transfer")
    parser.add_argument("--study", type=Path, default=Path("runs/quick"), help="finished study")
    parser.add_argument("--goals", type=int, default=100, help="held-out goals")
    parser.add_argument("--out", type=Path, default=Path("docs/results/quick"), help="folder")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    cases, clarke = [], False
    for arm in load_study(options.study).arms:
        config = load_config(TrainConfig, arm.done[0][0].path / "config.yaml")
        trained = int(config.env.kwargs["n_tendons"])
        if arm.representation != "clarke":
            cases += [(arm, trained, p, trained, False) for p in PHYSICS]
            cases += [(arm, trained, p, n, True) for p in PHYSICS for n in COUNTS]
        elif not clarke:  # trained on any n they are the same policies
            cases += [(arm, trained, p, n, False) for p in PHYSICS for n in COUNTS]
            clarke = True
    lines = [
        f"Policies of the study {options.study.name}, as they are, on other robots and the other "
        f"physics; {options.goals} held-out goals. Success: mean over the runs [lowest, highest]; "
        "tip error: mean over the runs of the median. Behind an adapter a raw policy reads and "
        "writes Clarke coordinates, which are decoded to the tendons that it was trained with.",
        "",
        "| representation | trained with n | run with n | physics | success | tip error, mm |",
        "| --- | ---: | ---: | --- | ---: | ---: |",
    ]
    for arm, trained, physics, n, adapted in tqdm(cases, unit="case", file=sys.stdout):
        success, error = results(
            arm, {"physics": physics, "n_tendons": n}, options.goals, adapted
        ).T
        spread = f"{success.mean():.2f} [{success.min():.2f}, {success.max():.2f}]"
        name = f"{arm.representation}, behind a Clarke adapter" if adapted else arm.representation
        where = f"{name} | {trained} | {n} | {physics}"
        lines.append(f"| {where} | {spread} | {error.mean():.2f} |")
    table = "\n".join(lines) + "\n"
    print(table)
    write_text(options.out / "transfer.md", table)


if __name__ == "__main__":
    main()
