"""Tip errors of the classical controller over physics, segments and tendons.

python -m benchmarks.classical_control [--goals 400] [--out docs/validation]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from tqdm import tqdm

from agents.files import write_text
from agents.learning.config import EnvSettings
from agents.learning.evaluation import HeldOutEvaluation
from clarke_gym.control.controllers import make_controller
from clarke_gym.numerics.arrays import FloatArray

PHYSICS = {"constant_curvature": 1.0, "mujoco": 3.0}
"""Each physics and the largest error that is asked for [% of length]."""
SEGMENTS, COUNTS = (1, 2, 3, 4, 5), (3, 7, 32)
STUDY_GOALS = 100
"""Goals of the studies; the controller's gains were tuned on them, not on the others."""


def errors(physics: str, segments: int, tendons: int, goals: int) -> FloatArray:
    """Return tip errors at the end of an episode [% of length], one a goal."""
    keywords: dict[str, bool | int | float | str] = {"physics": physics}
    keywords |= {"n_segments": segments, "n_tendons": tendons}
    evaluation = HeldOutEvaluation(EnvSettings(kwargs=keywords), goals)
    result = evaluation.run(make_controller("clarke_controller", evaluation.env))
    evaluation.close()
    return np.asarray(result["tip_error_percent"])


def main() -> None:
    """Measure every case; print and write a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.classical_control")
    parser.add_argument("--goals", type=int, default=400, help="goals a case")
    parser.add_argument("--out", type=Path, default=Path("docs/validation"), help="output folder")
    options = parser.parse_args()
    if options.goals <= STUDY_GOALS:
        parser.error(f"--goals must be above {STUDY_GOALS}, got {options.goals}")
    lines = [
        "Tip error of `clarke_controller` after 50 steps of 50 ms [% of the robot's length]: the "
        f"{STUDY_GOALS} held-out goals of the studies, and {options.goals - STUDY_GOALS} others.",
        "",
        "| physics | segments | tendons | mean | worst | worst of the others | asked for |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    cases = [(p, s, n) for p in PHYSICS for s in SEGMENTS for n in COUNTS]
    for physics, segments, tendons in tqdm(cases, unit="case", file=sys.stdout):
        found = errors(physics, segments, tendons, options.goals)
        study, others = found[:STUDY_GOALS], found[STUDY_GOALS:]
        lines.append(
            f"| {physics} | {segments} | {tendons} | {study.mean():.3f} | {study.max():.2f} "
            f"| {others.max():.2f} | {PHYSICS[physics]:g} |"
        )
    table = "\n".join(lines) + "\n"
    print(table)
    write_text(options.out / "classical_control.md", table)


if __name__ == "__main__":
    main()
