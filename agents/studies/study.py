"""A study: every representation x task x seed of one configuration, resumable."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from tqdm import tqdm

from agents import files
from agents.files import DONE, run_folder
from agents.learning.evaluation import HeldOutEvaluation
from agents.studies.config import StudyConfig
from agents.studies.executors import Job, run_pool
from clarke_gym.control import make_controller

REFERENCE = "clarke_controller"
"""Classical control shown beside the learning curves; the same for every representation."""


def progress_bar(total: int) -> tqdm[Any]:
    """Return a progress bar over environment steps, with rate and time left."""
    interval = 0.5 if sys.stdout.isatty() else 10.0  # a log file wants few lines
    return tqdm(
        total=total, unit="step", unit_scale=True, file=sys.stdout, mininterval=interval, ncols=100
    )


def write_references(config: StudyConfig, folder: Path) -> None:
    """Evaluate classical control on each task's held-out goals, once: a line in every figure.

    A task that classical control cannot do has no entry, and its figures no line.
    """
    path = folder / "references.json"
    if path.exists():
        return
    references = {}
    for run, (_, _, task) in zip(config.runs(), config.arms(), strict=False):  # the first seed's
        if task.label in references:
            continue
        evaluation = HeldOutEvaluation(run.env, run.evaluation.n_goals)
        try:
            controller = make_controller(REFERENCE, evaluation.env)
        except (TypeError, ValueError):  # it steers to positions; the task asks for something else
            evaluation.close()
            continue
        result = evaluation.run(controller)
        evaluation.close()
        references[task.label] = {
            "agent": REFERENCE,
            "success_rate": float(result["is_success"].mean()),
            "metrics": {m.name: float(result[m.name].mean()) for m in evaluation.metrics},
        }
    files.write_text(path, json.dumps(references, indent=2) + "\n")


def run_study(config: StudyConfig, folder: Path, workers: int | None = None) -> int:
    """Carry out the runs of a study that are not done yet.

    Parameters
    ----------
    config : StudyConfig
    folder : Path
        ``runs/<study>``.
    workers : int, optional
        Processes; the machine's cores by default.

    Returns
    -------
    int
        Number of runs that failed; their tracebacks are in FAILED beside them.

    Raises
    ------
    ConfigError
        If the folder holds another study.
    RuntimeError
        If another process is carrying out this study.
    """
    with files.locked(folder):
        files.keep_or_write_yaml(folder / "study.yaml", config.resolved())
        write_references(config, folder)
        jobs: list[Job] = [(run, run_folder(folder, run.name, run.seed)) for run in config.runs()]
        todo = [job for job in jobs if not (job[1] / DONE).exists()]
        if len(todo) < len(jobs):
            print(f"{len(jobs) - len(todo)} of {len(jobs)} runs are finished and kept")
        if not todo:
            return 0
        total = sum(run.total_steps for run, _ in todo)
        workers = min(workers or os.cpu_count() or 1, len(todo))
        failures = 0
        done = 0
        with progress_bar(total) as bar:
            bar.set_description(f"{config.name}: 0/{len(todo)} runs")
            for (_, run_dir), error in run_pool(todo, workers, bar.update):
                done += 1
                bar.set_description(f"{config.name}: {done}/{len(todo)} runs")
                if error is not None:
                    failures += 1
                    bar.write(f"{run_dir} failed: {error.strip().splitlines()[-1]}")
    return failures
