"""Policies that were trained undisturbed, under each disturbance of the suite at full strength.

python -m benchmarks.robustness [--study runs/robustness] [--out docs/results/robustness]

Writes robustness.csv: one row a run and disturbance. Rows that are there already are kept.
"""

from __future__ import annotations

import argparse
import csv
import io
import math
import sys
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from tqdm import tqdm

from agents.files import write_text
from agents.learning.acting import load_agent
from agents.learning.config import EnvSettings, TrainConfig, load_config
from agents.learning.evaluation import HeldOutEvaluation
from agents.reporting.cells import from_cell, to_cell
from agents.reporting.loading import load_study
from agents.reporting.small_samples import mean_difference_t
from agents.reporting.statistics import holm, welch_p
from agents.reporting.wording import with_interval
from benchmarks.committed_scores import DOCS, p_text, plain_table, registered
from clarke_gym.disturbances import DISTURBANCES
from clarke_gym.numerics.arrays import FloatArray

TABLE = "robustness.csv"
NOMINAL, PRESETS = "none", ("hardware", "harsh")
GOALS = 50

Key = tuple[str, str, int, str]
"""Task, arm, seed, disturbance."""


@dataclass(frozen=True)
class Score:
    """Success rate and mean tip error over the held-out goals of one run."""

    success: float
    error_mm: float


def read(path: Path) -> dict[Key, Score]:
    """Return the rows of a table; none where there is no file."""
    if not path.exists():
        return {}
    scores = {}
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            arm = from_cell(row["task"]), from_cell(row["representation"])
            values = float(row["success_rate"]), float(row["tip_error_mm"])
            scores[*arm, int(row["seed"]), row["disturbance"]] = Score(*values)
    return scores


def _text(scores: dict[Key, Score]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(
        ["task", "representation", "seed", "disturbance", "success_rate", "tip_error_mm"]
    )
    for (task, arm, seed, disturbance), score in scores.items():
        values = f"{score.success:.6g}", f"{score.error_mm:.6g}"
        writer.writerow([to_cell(task), to_cell(arm), seed, disturbance, *values])
    return buffer.getvalue()


def measure(study: Path, out: Path) -> None:
    """Evaluate every finished run under every disturbance that its physics has."""
    out.mkdir(parents=True, exist_ok=True)
    path = out / TABLE
    scores = read(path)
    arms = load_study(study).arms
    todo = [  # seeds outermost: an early stop leaves all arms comparable
        (arm, run, disturbance)
        for arm in arms
        for run, _ in arm.done
        for disturbance in (NOMINAL, *DISTURBANCES.names(), *PRESETS)
        if (arm.task, arm.representation, run.seed, disturbance) not in scores
    ]
    todo.sort(key=lambda case: case[1].seed)
    for arm, run, disturbance in tqdm(todo, unit="case", file=sys.stdout):
        config = load_config(TrainConfig, run.path / "config.yaml")
        keywords = config.env.kwargs | {"disturbances": disturbance}
        evaluation = HeldOutEvaluation(EnvSettings(id=config.env.id, kwargs=keywords), GOALS)
        found = evaluation.run(load_agent(run.path, config, "policy", evaluation.env))
        evaluation.close()
        error_mm = 1e3 * np.minimum(found["tip_error_m"], 1.0).mean()  # a diverged one is infinite
        scores[arm.task, arm.representation, run.seed, disturbance] = Score(
            float(found["is_success"].mean()), float(error_mm)
        )
        write_text(path, _text(scores))


@cache
def committed() -> dict[Key, Score]:
    """Return the table of docs/results: the seeds that every arm has met every disturbance with."""
    scores = read(DOCS / "results" / "robustness" / TABLE)
    seeds = Counter(seed for _, _, seed, _ in scores)
    whole = {seed for seed, count in seeds.items() if count == max(seeds.values())}
    return {key: score for key, score in scores.items() if key[2] in whole}


def _difference(raw: FloatArray, clarke: FloatArray) -> str:
    """Return the difference of two means with its interval, the number alone without."""
    gap = mean_difference_t(raw, clarke)
    if max(np.ptp(raw), np.ptp(clarke)) == 0.0:
        return f"{gap.estimate:.2g}"
    return with_interval(gap, 2, sign=True)


def _successes(task: str, arm: str, disturbances: tuple[str, ...]) -> FloatArray:
    """Return the success of every seed, averaged over disturbances."""
    found = committed()
    seeds = sorted({seed for t, a, seed, _ in found if (t, a) == (task, arm)})
    rows = [[found[task, arm, seed, name].success for name in disturbances] for seed in seeds]
    return np.array([math.fsum(row) / len(row) for row in rows])  # equal rows have equal means


def singles() -> tuple[str, ...]:
    """Return the disturbances that were tested one at a time."""
    names = dict.fromkeys(name for _, _, _, name in committed())
    return tuple(name for name in names if name not in (NOMINAL, *PRESETS))


def table() -> str:
    """Return success under no, each and all disturbances, raw beside Clarke."""
    tasks = list(dict.fromkeys(task for task, _, _, _ in committed()))
    groups = {
        "undisturbed": (NOMINAL,),
        **{f"`{name}`": (name,) for name in singles()},
        "mean over these": singles(),
        **{f"preset `{name}`": (name,) for name in PRESETS},
    }
    head = ["disturbance"]
    for task in tasks:
        head += [f"raw, {task}", f"Clarke, {task}", "raw minus Clarke"]
    rows = [head]
    for label, names in groups.items():
        row = [label]
        for task in tasks:
            raw, clarke = (_successes(task, arm, names) for arm in ("raw", "clarke"))
            row += [f"{raw.mean():.2f}", f"{clarke.mean():.2f}"]
            row.append(_difference(raw, clarke))
        rows.append(row)
    return plain_table(rows)


def robust_words() -> dict[str, str]:
    """Return what the page's {names} stand for."""
    tasks = list(dict.fromkeys(task for task, _, _, _ in committed()))
    pairs = [[_successes(task, arm, singles()) for arm in ("raw", "clarke")] for task in tasks]
    p = holm([welch_p(*pair) for pair in pairs])
    seeds = {seed for _, _, seed, _ in committed()}
    found = {
        "robust_table": table(),
        "robust_count": str(len(singles())),
        "robust_seeds": str(len(seeds)),
        "robust_registered": registered("robustness"),
    }
    for task, pair, value in zip(tasks, pairs, p, strict=True):
        key = task.replace(" = ", "_")
        found[f"robust_{key}"] = _difference(*pair)
        found[f"robust_p_{key}"] = p_text(float(value))
        for name in singles():
            found[f"robust_{name}_{key}"] = _difference(
                *(_successes(task, arm, (name,)) for arm in ("raw", "clarke"))
            )
    return found


def main() -> None:
    """Measure what is missing."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.robustness")
    parser.add_argument("--study", type=Path, default=Path("runs/robustness"))
    parser.add_argument("--out", type=Path, default=DOCS / "results" / "robustness")
    options = parser.parse_args()
    measure(options.study, options.out)


if __name__ == "__main__":
    main()
