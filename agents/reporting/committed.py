"""Studies read back from what is committed of them: study.yaml, curves.csv, runs.csv, metrics.json.

Success rates are exact; metrics are means over goals, so that figures and tables that need every
goal have nothing to show.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from agents.metrics import FILE, Metric, read_metrics_by_task
from agents.reporting.cells import from_cell
from agents.reporting.loading import registered
from agents.reporting.results import Arm, Array, Evals, ResultsError, Run, Status, Study
from agents.yaml_files import read_yaml

CURVES, RUNS = "curves.csv", "runs.csv"

_FIXED = ("task", "representation", "seed", "env_steps", "success_rate")


def _rows(path: Path) -> list[dict[str, str]]:
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error


def _metric(column: str) -> Metric:
    """Return the metric of a column of shown values.

    Examples
    --------
    >>> _metric("tip_error_mm")
    Metric(name='tip_error_m', label='tip error', unit='m', worst=inf)
    """
    return Metric.from_name(f"{column.removesuffix('_mm')}_m" if column.endswith("_mm") else column)


def _evals(rows: list[dict[str, str]], goals: int, declared: tuple[Metric, ...]) -> Evals:
    own = [c for c in rows[0] if c not in _FIXED and rows[0][c]]  # other tasks measure others
    columns = {metric: metric.shown_name for metric in declared if metric.shown_name in own}
    columns |= {_metric(c): c for c in own if c not in columns.values()}
    success = np.array([float(row["success_rate"]) for row in rows])
    counts = np.rint(success * goals).astype(int)
    if np.abs(counts / goals - success).max() > 1e-5:
        raise ResultsError(f"{CURVES}: success rates are not whole numbers of {goals} goals")
    return Evals(
        env_steps=np.array([int(row["env_steps"]) for row in rows], np.int64),
        is_success=np.arange(goals) < counts[:, None],
        episode_return=np.zeros((len(rows), goals)),
        metrics=tuple(columns),
        values={m.name: _column(rows, c, goals) / m.factor for m, c in columns.items()},
    )


def _column(rows: list[dict[str, str]], column: str, goals: int) -> Array:
    means = np.array([float(row[column]) for row in rows])
    return np.repeat(means[:, None], goals, axis=1)


def _arm(row: dict[str, str]) -> tuple[str, str]:
    return from_cell(row["task"]), from_cell(row["representation"])


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def load_committed(folder: Path) -> Study:
    """Return a study whose run folders are elsewhere, as far as its committed files tell.

    Parameters
    ----------
    folder : Path
        With study.yaml, curves.csv and runs.csv, as a report writes them, and its metrics.json;
        without that names of columns alone tell what a metric is.

    Returns
    -------
    Study
        Its runs have `wall_s` None; `per_goal` is False.

    Raises
    ------
    ResultsError
        If a file is missing or does not hold what it should.
    """
    data = read_yaml(folder / "study.yaml")
    try:
        goals = int(data["base"]["evaluation"]["n_goals"])
        curves: dict[tuple[tuple[str, str], int], list[dict[str, str]]] = defaultdict(list)
        for row in _rows(folder / CURVES):
            curves[_arm(row), int(row["seed"])].append(row)
        metrics = read_metrics_by_task(folder / FILE)
        manifests = {
            (_arm(row), int(row["seed"])): {
                **{key: _number(row[key]) for key in ("wall_s", "cpu_s")},
                "git_sha": row["git_sha"],
                "git_dirty": row["git_dirty"] == "True",
                "status": row["status"],
            }
            for row in _rows(folder / RUNS)
        }
        arms = []
        for entry in data["arms"]:
            runs = []
            for seed in entry["seeds"]:
                key = ((entry["task"], entry["representation"]), seed)
                known = metrics.get(entry["task"], ())
                evals = _evals(curves[key], goals, known) if key in curves else None
                manifest = manifests.get(key, {})
                failed = manifest.get("status") == "failed"
                status: Status = "done" if evals else "failed" if failed else "missing"
                path = folder / entry["name"]
                runs.append(Run(entry["name"], seed, path, status, evals, manifest, None))
            arms.append(Arm(entry["name"], entry["representation"], entry["task"], tuple(runs)))
        grid = next(evals.env_steps for arm in arms for _, evals in arm.done)
        return Study(
            name=data["name"],
            title=data["title"],
            note=data["note"],
            baseline=data["baseline"],
            threshold=float(data["thresholds"]["success"]),
            tuning=data["tuning"],
            total_steps=int(data["total_steps"]),
            arms=tuple(arms),
            env_steps=grid,
            references={},
            base=data["base"],
            **registered(data),
            per_goal=False,
        )
    except (AttributeError, KeyError, TypeError, ValueError, StopIteration) as error:
        if isinstance(error, ResultsError):
            raise
        raise ResultsError(f"{folder}: {type(error).__name__}: {error}") from error
