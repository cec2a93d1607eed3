"""What happened inside the runs of a study: means over the seeds of each arm."""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from agents.reporting.bootstrap import Array
from agents.reporting.cells import from_cell, to_cell
from agents.reporting.results import Arm, ResultsError, Study

FILE, TABLE = "diagnostics.npz", "diagnostics.csv"

LABELS = {
    "noise_on": "noise on the manifold",
    "noise_off": "noise off the manifold",
    "mean_on": "mean action on the manifold",
    "saturated": "share of steps at the speed limit",
    "command_off": "command off the manifold / its limit",
    "capped": "share of commands at that limit",
    "slack": "share of steps with a slack tendon",
    "approx_kl": "approximate KL an update",
    "clip_fraction": "share of ratios clipped",
    "gradient_head_on": "gradient of the mean, on the manifold",
    "gradient_head_off": "gradient of the mean, off the manifold",
    "explained_variance": "explained variance of the critic",
    "ent_coef": "temperature of the entropy",
    "critic_loss": "loss of the critics",
}
"""Quantities that reports show, and their names there."""

POINTS = 40
"""Rows of an arm in the table, at most."""


@dataclass(frozen=True)
class Inside:
    """Quantities of one arm over its updates: means over seeds."""

    task: str
    representation: str
    env_steps: Array  # (U,)
    values: Mapping[str, Array]  # a key of LABELS -> (U,)


def _load(path: Path) -> dict[str, Array]:
    try:
        with np.load(path, allow_pickle=False) as file:
            names = ["env_steps", *LABELS]
            return {name: np.asarray(file[name], float) for name in names if name in file.files}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error


def _of_arm(arm: Arm) -> Inside | None:
    found = [_load(run.path / FILE) for run, _ in arm.done if (run.path / FILE).is_file()]
    if not found or any(len(f["env_steps"]) != len(found[0]["env_steps"]) for f in found):
        return None
    steps = found[0]["env_steps"]
    thin = np.unique(np.linspace(0, len(steps) - 1, min(POINTS, len(steps))).round().astype(int))
    names = [name for name in LABELS if all(name in f for f in found)]
    means = {name: np.mean([f[name] for f in found], axis=0)[thin] for name in names}
    return Inside(arm.task, arm.representation, steps[thin], means)


def load_inside(study: Study) -> list[Inside]:
    """Return what is known of every arm; older runs have written nothing.

    Raises
    ------
    ResultsError
        If a file cannot be read.
    """
    return [inside for arm in study.arms if (inside := _of_arm(arm)) is not None]


def inside_csv(rows: Sequence[Inside]) -> str:
    """Return ``diagnostics.csv``: the means, empty where an arm has no such quantity."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["task", "representation", "env_steps", *LABELS])
    for inside in rows:
        labels = [to_cell(inside.task), to_cell(inside.representation)]
        for i, steps in enumerate(inside.env_steps):
            numbers = [
                f"{inside.values[name][i]:.5g}" if name in inside.values else "" for name in LABELS
            ]
            writer.writerow([*labels, int(steps), *numbers])
    return text.getvalue()


def read_inside(path: Path) -> list[Inside]:
    """Return what a ``diagnostics.csv`` holds.

    Raises
    ------
    ResultsError
        If it cannot be read.
    """
    arms: dict[tuple[str, str], list[dict[str, str]]] = {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                arm = (from_cell(row["task"]), from_cell(row["representation"]))
                arms.setdefault(arm, []).append(row)
        return [
            Inside(
                *key,
                np.array([float(row["env_steps"]) for row in rows]),
                {
                    name: np.array([float(row[name]) for row in rows])
                    for name in LABELS
                    if rows[0].get(name)  # earlier reports knew fewer
                },
            )
            for key, rows in arms.items()
        ]
    except (OSError, KeyError, ValueError, csv.Error) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error
