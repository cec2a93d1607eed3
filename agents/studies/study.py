"""A study: every representation x task x seed of one configuration, resumable."""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import Any

from tqdm import tqdm

from agents import files
from agents.files import DONE, run_folder
from agents.learning.evaluation import HeldOutEvaluation
from agents.studies.config import StudyConfig
from agents.studies.executors import Job, Outcome, run_pool
from agents.yaml_files import keep_or_write_yaml
from clarke_gym.control import make_controller

STUDY, REFERENCES = "study.yaml", "references.json"

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
    path = folder / REFERENCES
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


def run_study(config: StudyConfig, folder: Path, workers: int | None = None) -> Counter[Outcome]:
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
    dict
        Number of runs that ended ``done``, ``failed`` (their policies are no longer finite; FAILED
        beside them says so) and ``unfinished`` (a fault of the machine or the folder; the next call
        continues them).

    Raises
    ------
    ConfigError
        If the folder holds another study or something else.
    RuntimeError
        If another process is carrying out this study.
    """
    files.refuse_foreign(folder, STUDY)
    with files.locked(folder):
        files.refuse_links(folder, (STUDY, REFERENCES, *(name for name, _, _ in config.arms())))
        files.sweep(folder)
        keep_or_write_yaml(folder / STUDY, config.resolved())
        write_references(config, folder)
        jobs: list[Job] = [(run, run_folder(folder, run.name, run.seed)) for run in config.runs()]
        todo = [job for job in jobs if not (job[1] / DONE).exists()]
        ends: Counter[Outcome] = Counter()
        if len(todo) < len(jobs):
            print(f"{len(jobs) - len(todo)} of {len(jobs)} runs are finished and kept")
        if not todo:
            return ends
        total = sum(run.total_steps for run, _ in todo)
        workers = min(workers or os.cpu_count() or 1, len(todo))
        with progress_bar(total) as bar:
            bar.set_description(f"{config.name}: 0/{len(todo)} runs")
            with closing(run_pool(todo, workers, bar.update, bar.write)) as pool:
                for end in pool:
                    ends[end.outcome] += 1
                    bar.set_description(f"{config.name}: {ends.total()}/{len(todo)} runs")
                    if end.outcome != "done":
                        bar.write(f"{end.job[1]} {end.outcome}: {end.reason}")
    return ends
