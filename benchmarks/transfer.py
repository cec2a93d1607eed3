"""Policies of a finished study on robots that they were not trained on, without any change.

python -m benchmarks.transfer [--study runs/quick] [--goals 100] [--out docs/results/quick]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from tqdm import tqdm

from agents.files import write_text
from agents.learning.config import EnvSettings, TrainConfig, load_config
from agents.learning.evaluation import HeldOutEvaluation, load_agent
from agents.reporting.loading import load_study
from agents.reporting.results import Arm
from clarke_gym.numerics.arrays import FloatArray

COUNTS = (3, 4, 7, 11, 32)
PHYSICS = ("constant_curvature", "mujoco")


def results(arm: Arm, keywords: dict[str, bool | int | float | str], goals: int) -> FloatArray:
    """Return success rate and median tip error [mm] of each finished run, shape (runs, 2)."""
    rows = []
    for run, _ in arm.done:
        config = load_config(TrainConfig, run.path / "config.yaml")
        settings = EnvSettings(id=config.env.id, kwargs=config.env.kwargs | keywords)
        evaluation = HeldOutEvaluation(settings, goals)
        found = evaluation.run(load_agent(run.path, config, "policy", evaluation.env))
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
    cases, clarke = [], False
    for arm in load_study(options.study).arms:
        config = load_config(TrainConfig, arm.done[0][0].path / "config.yaml")
        trained = int(config.env.kwargs["n_tendons"])
        if arm.representation != "clarke":
            cases += [(arm, trained, p, trained) for p in PHYSICS]
        elif not clarke:  # trained on any n they are the same policies
            cases += [(arm, trained, p, n) for p in PHYSICS for n in COUNTS]
            clarke = True
    lines = [
        f"Policies of the study {options.study.name}, as they are, on other robots and the other "
        f"physics; {options.goals} held-out goals. Success: mean over the runs [lowest, highest]; "
        "tip error: mean over the runs of the median.",
        "",
        "| representation | trained with n | run with n | physics | success | tip error, mm |",
        "| --- | ---: | ---: | --- | ---: | ---: |",
    ]
    for arm, trained, physics, n in tqdm(cases, unit="case", file=sys.stdout):
        success, error = results(arm, {"physics": physics, "n_tendons": n}, options.goals).T
        spread = f"{success.mean():.2f} [{success.min():.2f}, {success.max():.2f}]"
        where = f"{arm.representation} | {trained} | {n} | {physics}"
        lines.append(f"| {where} | {spread} | {error.mean():.2f} |")
    table = "\n".join(lines) + "\n"
    print(table)
    write_text(options.out / "transfer.md", table)


if __name__ == "__main__":
    main()
