"""Equal tuning: every arm of a study gets the same quasi-random configurations, seeds and steps.

The scores of all trials are kept in an Optuna journal, one Optuna study an arm, and published as a
table; the winners are written as representations of a study that reruns them on fresh seeds.
"""

from __future__ import annotations

import csv
import io
import warnings
from collections import Counter
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from agents import files
from agents.files import DONE, EVALS, TRIALS, ConfigError
from agents.learning.config import TrainConfig, validated
from agents.metrics import auc
from agents.studies.config import Search, StudyConfig
from agents.studies.executors import Job, Outcome, run_pool
from agents.studies.study import progress_bar
from agents.yaml_files import keep_or_write_yaml, yaml_text

if TYPE_CHECKING:
    import optuna

STUDY, JOURNAL, WINNERS = "tuning.yaml", "journal.log", "winners.yaml"


def _optuna() -> Any:
    try:
        import optuna
    except ModuleNotFoundError:
        raise ConfigError(
            "tuning needs optuna, which is not installed: python -m pip install --group tune"
        ) from None
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def configurations(search: Search) -> list[dict[str, float]]:
    """Return the settings that every arm is tried with.

    Parameters
    ----------
    search : Search

    Returns
    -------
    list of dict
        `search.configurations` of them, quasi-random (Sobol, scrambled by the search's seed).

    Raises
    ------
    ConfigError
        If Optuna is not installed.
    """
    optuna = _optuna()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler = optuna.samplers.QMCSampler(seed=search.seed, scramble=True)
    study = optuna.create_study(sampler=sampler)
    spaces = _distributions(search)
    found = []
    for _ in range(search.configurations + 1):  # the first is drawn before the space is known
        trial = study.ask(spaces)
        study.tell(trial, 0.0)
        found.append({name: float(trial.params[name]) for name in search.space})
    return found[1:]


def _distributions(search: Search) -> dict[str, optuna.distributions.BaseDistribution]:
    optuna = _optuna()
    return {
        name: optuna.distributions.FloatDistribution(r.low, r.high, log=r.log)
        for name, r in search.space.items()
    }


def _jobs(
    config: StudyConfig, search: Search, folder: Path, settings: list[dict[str, float]]
) -> dict[tuple[str, int], list[Job]]:
    """Return the runs of every arm and configuration."""
    jobs: dict[tuple[str, int], list[Job]] = {}
    by_arm = {run.name: run for run in config.runs()}
    for name, run in by_arm.items():
        for i, changes in enumerate(settings):
            for seed in search.seeds:
                data = run.model_dump()
                data["algo"].update(changes)
                data |= {"name": f"{name}_{i:02d}", "seed": seed}
                path = files.run_folder(folder, f"{name}/config_{i:02d}", seed)
                where = f"search: configuration {i} of {name}"
                jobs.setdefault((name, i), []).append((validated(TrainConfig, data, where), path))
    return jobs


def _run(jobs: list[Job], workers: int) -> Counter[Outcome]:
    """Carry out what is not done."""
    ends: Counter[Outcome] = Counter()
    todo = [job for job in jobs if not files.is_over(job[1])]
    if not todo:
        return ends
    with progress_bar(sum(run.total_steps for run, _ in todo)) as bar:
        pool = run_pool(todo, min(workers, len(todo)), bar.update, bar.write)
        with closing(pool):
            for end in pool:
                ends[end.outcome] += 1
                if end.outcome != "done":
                    bar.write(f"{end.job[1]} {end.outcome}: {end.reason}")
    return ends


def _score(path: Path) -> float:
    """Return the AUC of success of a run; 0 where its policy was no longer finite."""
    if not (path / DONE).is_file():
        return 0.0
    evals = files.read_npz((path / EVALS).read_bytes())
    return float(auc(evals["env_steps"], evals["is_success"].mean(axis=1)))


def tune(config: StudyConfig, folder: Path, workers: int = 1) -> Counter[Outcome]:
    """Try every configuration on every arm, and write what came of it.

    Parameters
    ----------
    config : StudyConfig
        With a `search`.
    folder : Path
        ``runs/<study>_tuning``; runs that are finished there are kept.
    workers : int
        Processes.

    Returns
    -------
    dict
        Runs that ended ``done``, ``failed`` and ``unfinished`` in this call.

    Raises
    ------
    ConfigError
        If the study has no search, Optuna is not installed, or the folder holds something else.
    RuntimeError
        If another process is writing into the folder.
    """
    search = config.search
    if search is None:
        raise ConfigError(f"study {config.name!r} has no search: nothing says what to tune")
    for variant in (*config.representations, *config.tasks):
        if twice := sorted({*variant.algo} & {*search.space}):
            raise ConfigError(
                f"{variant.label!r} sets {', '.join(twice)}, which search.space would set again: "
                "all arms would be tried with the same"
            )
    settings = configurations(search)
    files.refuse_foreign(folder, STUDY)
    jobs = _jobs(config, search, folder, settings)  # what cannot be tried leaves no folder
    with files.locked(folder):
        keep_or_write_yaml(folder / STUDY, config.model_dump(mode="json"))
        ends = _run([job for group in jobs.values() for job in group], workers)
        if not ends["unfinished"]:
            scores = {key: [_score(path) for _, path in group] for key, group in jobs.items()}
            _publish(config, search, folder, settings, scores)
    return ends


def _publish(
    config: StudyConfig,
    search: Search,
    folder: Path,
    settings: list[dict[str, float]],
    scores: dict[tuple[str, int], list[float]],
) -> None:
    """Write the journal, every trial as a table, and the winners as representations."""
    optuna = _optuna()
    (folder / JOURNAL).unlink(missing_ok=True)  # it follows from the runs
    backend = optuna.storages.journal.JournalFileBackend(str(folder / JOURNAL))
    storage = optuna.storages.JournalStorage(backend)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["arm", "configuration", *search.space, "seed", "auc"])
    winners = []
    for name, representation, task in config.arms():
        study = optuna.create_study(study_name=name, storage=storage, direction="maximize")
        for i, changes in enumerate(settings):
            for seed, score in zip(search.seeds, scores[name, i], strict=True):
                writer.writerow([name, i, *changes.values(), seed, f"{score:.6g}"])
            trial = optuna.trial.create_trial(
                params=changes,
                distributions=_distributions(search),
                value=float(np.mean(scores[name, i])),
            )
            study.add_trial(trial)
        best = representation.model_dump(mode="json")
        best["algo"] = {**best["algo"], **study.best_params}
        winners.append({"task": task.label, "auc": study.best_value, "representation": best})
    files.write_text(folder / TRIALS, text.getvalue())
    files.write_text(folder / WINNERS, yaml_text({"winners": winners}))
