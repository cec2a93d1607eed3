"""A study: every representation x task x seed of one configuration, resumable."""

from __future__ import annotations

import json
import os
import sys
from collections import Counter
from contextlib import closing
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

from tqdm import tqdm

from agents import files
from agents.files import DONE, run_folder
from agents.learning.evaluation import HeldOutEvaluation
from agents.studies.cluster import connect, run_cluster
from agents.studies.config import StudyConfig, growth
from agents.studies.executors import Job, Outcome, run_pool
from agents.yaml_files import read_yaml, yaml_text
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
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if {task.label for _, _, task in config.arms()} <= {*known}:
        return
    references = dict(known)
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
    if references != known or not path.exists():
        files.write_text(path, json.dumps(references, indent=2) + "\n")


def keep_or_grow(path: Path, config: StudyConfig) -> None:
    """Write study.yaml; one that is there may get more arms or seeds, and nothing else.

    Arms of a preregistered study are part of what was registered: it gets more seeds alone.

    Raises
    ------
    ConfigError
        If the file says something else: the runs beside it belong to that.
    """
    wanted = config.resolved()
    if path.exists():
        found = read_yaml(path)
        if found == wanted:
            return
        if changed := growth(found, wanted):
            raise files.ConfigError(
                f"{path} holds another configuration (different: {', '.join(changed)}; a study can "
                "get more arms or seeds, a preregistered one more seeds); nothing was changed. "
                "Choose another name or --out, or move that folder away."
            )
    files.write_text(path, yaml_text(wanted))


def plan(config: StudyConfig, folder: Path) -> str:
    """Return what a study would do: runs, CPU hours and disk, judged by finished runs around it.

    Parameters
    ----------
    config : StudyConfig
    folder : Path
        ``runs/<study>``; it and the folders beside it are searched, and nothing is written.

    Returns
    -------
    str
        A few lines.
    """
    runs = [(run, run_folder(folder, run.name, run.seed)) for run in config.runs()]
    todo = [run for run, path in runs if not files.is_over(path)]
    failed = sum(files.has_failed(path) for _, path in runs)
    rates: dict[tuple[str, bool], list[float]] = {}
    sizes: list[int] = []
    for done in sorted(folder.parent.glob(f"*/*/seed_*/{DONE}")):
        try:
            spent = json.loads((done.parent / files.MANIFEST).read_text())["cpu_s"]
            earlier = read_yaml(done.parent / files.CONFIG)
            key = (earlier["algo"]["name"], earlier["env"]["kwargs"].get("physics") == "mujoco")
            rates.setdefault(key, []).append(spent / earlier["total_steps"])
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue
        sizes.append(sum(p.stat().st_size for p in done.parent.rglob("*") if p.is_file()))
    keys = [(run.algo.name, run.env.kwargs.get("physics") == "mujoco") for run in todo]
    known = [
        median(rates[key]) * run.total_steps
        for key, run in zip(keys, todo, strict=True)
        if key in rates
    ]
    lines = [
        f"{config.name}: {len(config.arms())} arms x {len(config.seeds)} seeds = {len(runs)} runs, "
        f"{len(runs) - len(todo) - failed} finished, {f'{failed} failed, ' if failed else ''}"
        f"{len(todo)} to do",
        f"environment steps: {sum(run.total_steps for run in todo):,}",
    ]
    if todo and known:
        known_for = "" if len(known) == len(todo) else f" (known for {len(known)} of {len(todo)})"
        size = median(sizes) * len(todo) / 1e6
        lines.append(f"CPU: {sum(known) / 3600:.1f} h{known_for}; disk: {size:.0f} MB")
    elif todo:
        lines.append(f"CPU and disk: unknown, no run like these is finished in {folder.parent}")
    if config.registered:
        lines.append(f"preregistered: {config.registered[:12]}")
    return "\n".join(lines)


def run_study(
    config: StudyConfig, folder: Path, workers: int | None = None, ray: str | None = None
) -> Counter[Outcome]:
    """Carry out the runs of a study that are neither finished nor failed.

    Parameters
    ----------
    config : StudyConfig
    folder : Path
        ``runs/<study>``.
    workers : int, optional
        Processes; the machine's cores by default.
    ray : str, optional
        Address of a cluster that carries out the runs instead, as many at a time as it has cores.

    Returns
    -------
    dict
        Number of runs that ended ``done``, ``failed`` (their policies are no longer finite, FAILED
        beside them says so; those of earlier calls, too) and ``unfinished`` (a fault of the machine
        or the folder; the next call continues them).

    Raises
    ------
    ConfigError
        If the folder holds another study or something else, or no cluster answers.
    RuntimeError
        If another process is carrying out this study.
    """
    if ray is not None:
        connect(ray)
    files.refuse_foreign(folder, STUDY)
    with files.locked(folder):
        files.refuse_links(folder, (STUDY, REFERENCES, *(name for name, _, _ in config.arms())))
        files.sweep(folder)
        keep_or_grow(folder / STUDY, config)
        write_references(config, folder)
        jobs: list[Job] = [(run, run_folder(folder, run.name, run.seed)) for run in config.runs()]
        todo = [job for job in jobs if not files.is_over(job[1])]
        failed = [path for _, path in jobs if files.has_failed(path)]
        ends: Counter[Outcome] = Counter({"failed": len(failed)} if failed else {})
        if len(todo) < len(jobs):
            kept = len(jobs) - len(todo) - len(failed)
            print(f"{kept} of {len(jobs)} runs are finished and kept")
        if failed:
            print(
                f"{len(failed)} failed before: {failed[0] / files.FAILED} says why; where that "
                "file is deleted a run is tried again"
            )
        if not todo:
            return ends
        total = sum(run.total_steps for run, _ in todo)
        workers = min(workers or os.cpu_count() or 1, len(todo))
        with progress_bar(total) as bar:
            bar.set_description(f"{config.name}: 0/{len(todo)} runs")
            pool = partial(run_pool, todo, workers) if ray is None else partial(run_cluster, todo)
            with closing(pool(bar.update, bar.write)) as runs:
                for end in runs:
                    ends[end.outcome] += 1
                    over = ends.total() - len(failed)
                    bar.set_description(f"{config.name}: {over}/{len(todo)} runs")
                    if end.outcome != "done":
                        bar.write(f"{end.job[1]} {end.outcome}: {end.reason}")
    return ends
