"""Loading a study's run folders into typed, validated arrays."""

import csv
import json
import math
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from agents.files import DONE, EVALS, FAILED, GOALS, MANIFEST, ConfigError, damage, run_folder
from agents.metrics import FILE as METRICS_FILE
from agents.metrics import Metric, read_metrics
from agents.registration import registration
from agents.reporting.results import Arm, Array, Evals, Reference, ResultsError, Run, Status, Study
from agents.yaml_files import read_yaml


def _key(data: Mapping[str, Any], key: str, kind: type | tuple[type, ...], where: str) -> Any:
    """Value of a required key, checked for its type."""
    if not isinstance(data, Mapping):
        raise ResultsError(f"{where}: expected a mapping, found {type(data).__name__}")
    if key not in data:
        raise ResultsError(f"{where}: key '{key}' is missing")
    value = data[key]
    if isinstance(value, bool) or not isinstance(value, kind):
        raise ResultsError(f"{where}: key '{key}' has the wrong type ({type(value).__name__})")
    return value


_ALWAYS = ("env_steps", "is_success", "episode_return")
"""Arrays of every ``evals.npz``; the others are metrics, and `GOALS` where goals are places."""


def _metrics(run: Path, arrays: Iterable[str]) -> tuple[Metric, ...]:
    """Return what the metrics of a finished run are, the leading one first.

    Runs of version 0.1 have no ``metrics.json``: there the metrics are the other arrays of
    ``evals.npz`` in their order, read as errors in the unit that ends their name.
    """
    path = run / METRICS_FILE
    if not path.is_file():
        return tuple(Metric.from_name(name) for name in arrays if name not in (*_ALWAYS, GOALS))
    try:
        return read_metrics(path)
    except (OSError, ValueError, TypeError) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error


def load_evals(path: Path) -> Evals:
    """Read and check one ``evals.npz``, and ``metrics.json`` beside it.

    Raises
    ------
    ResultsError
        If the file is missing or corrupt, or an array is missing or ill-shaped, holds
        non-finite values, or needs pickle.
    """
    arrays: dict[str, NDArray[Any]] = {}
    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            metrics = _metrics(path.parent, file.files)
            for key in (*_ALWAYS, *(metric.name for metric in metrics)):
                try:
                    arrays[key] = np.asarray(file[key])
                except (KeyError, ValueError) as error:
                    raise ResultsError(f"{path}: key '{key}': {error}") from error
            goals = np.asarray(file[GOALS], float) if GOALS in file.files else None
    except ResultsError:
        raise
    except (OSError, EOFError, ValueError, AttributeError, zipfile.BadZipFile) as error:
        raise ResultsError(f"{path}: not a readable npz file: {error}") from error
    steps = arrays["env_steps"]
    if steps.ndim != 1 or steps.size < 2 or not (np.diff(steps) > 0).all():
        raise ResultsError(f"{path}: key 'env_steps' must increase over two or more evaluations")
    shape = (steps.size, *arrays["is_success"].shape[1:2])
    for key, array in arrays.items():
        if key != "env_steps" and (array.shape != shape or len(shape) != 2 or array.size == 0):
            raise ResultsError(f"{path}: key '{key}' has shape {array.shape}, not (evals, goals)")
        if array.dtype.kind not in "biuf" or not np.isfinite(array).all():
            raise ResultsError(f"{path}: key '{key}' holds values that are not finite numbers")
    if goals is not None and (goals.shape != (shape[1], 3) or not np.isfinite(goals).all()):
        raise ResultsError(f"{path}: key '{GOALS}' must hold finite positions (goals, 3)")
    if not np.isin(arrays["is_success"], (0, 1)).all():
        raise ResultsError(f"{path}: key 'is_success' holds values other than true and false")
    return Evals(
        env_steps=steps.astype(np.int64),
        is_success=arrays["is_success"].astype(bool),
        episode_return=arrays["episode_return"].astype(float),
        metrics=metrics,
        values={metric.name: arrays[metric.name].astype(float) for metric in metrics},
        goals=goals,
    )


def _manifest(path: Path) -> dict[str, Any]:
    """Read a manifest; every key is optional, but what is there must be readable."""
    if not path.is_file():
        return {}
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ResultsError(f"{path}: not valid JSON: {error}") from error
    if not isinstance(data, dict):
        raise ResultsError(f"{path}: expected a mapping, found {type(data).__name__}")
    return data


def _wall_clock(path: Path, env_steps: NDArray[np.int64]) -> Array | None:
    """Wall seconds at the given steps, interpolated in ``progress.csv``; None if not offered."""
    if not path.is_file():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        rows = [(r.get("env_steps"), r.get("wall_s")) for r in csv.DictReader(file)]
    try:
        points = np.array([(float(x), float(t)) for x, t in rows if x and t])
    except ValueError as error:
        raise ResultsError(f"{path}: column 'env_steps' or 'wall_s': {error}") from error
    if points.size == 0 or (np.diff(points, axis=0) < 0).any():
        return None  # a resumed run may restart its clock: then there is no honest axis
    start = np.zeros((1, 2))
    x, t = np.concatenate([start, points]).T
    return cast(Array, np.interp(env_steps, x, t))


def load_run(path: Path, arm: str, seed: int) -> Run:
    """Load one run folder; an absent folder is a missing run."""
    status: Status = "missing"
    if (path / DONE).is_file():  # it wins: a run that failed once may have been finished since
        status = "done"
        if found := damage(path):
            raise ResultsError(
                f"damaged run: {found}; move {path} away and start the study again to redo it"
            )
    elif (path / FAILED).is_file():
        status = "failed"
    evals = load_evals(path / EVALS) if status == "done" else None
    wall = _wall_clock(path / "progress.csv", evals.env_steps) if evals else None
    return Run(arm, seed, path, status, evals, _manifest(path / MANIFEST), wall)


def _load_arm(entry: Any, folder: Path, where: str) -> Arm:
    name = _key(entry, "name", str, where)
    where = f"{where} '{name}'"
    if "/" in name or "\\" in name or "\0" in name or name in ("", ".", ".."):
        raise ResultsError(f"{where}: key 'name' must name a folder in the study's own")
    seeds = _key(entry, "seeds", list, where)
    whole = all(isinstance(s, int) and not isinstance(s, bool) and s >= 0 for s in seeds)
    if not seeds or not whole or len(set(seeds)) < len(seeds):
        raise ResultsError(f"{where}: key 'seeds' must list one or more different whole numbers")
    runs = tuple(load_run(run_folder(folder, name, seed), name, seed) for seed in seeds)
    representation, task = (_key(entry, key, str, where) for key in ("representation", "task"))
    return Arm(name, representation, task, runs)


def _finite(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f"{value} is not finite")
    return number


def _load_references(path: Path) -> dict[str, Reference]:
    if not path.exists():
        return {}
    try:
        entries = json.loads(path.read_text(encoding="utf-8"))
        return {
            str(task): Reference(
                str(entry["agent"]),
                _finite(entry["success_rate"]),
                {str(name): _finite(value) for name, value in entry.get("metrics", {}).items()},
            )
            for task, entry in entries.items()
        }
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error


def _threshold(data: Mapping[str, Any], where: str) -> float:
    levels = _key(data, "thresholds", dict, where)
    level = float(_key(levels, "success", (int, float), f"{where}: thresholds"))
    if not 0.0 <= level <= 1.0:
        raise ResultsError(f"{where}: thresholds: key 'success' must lie in [0, 1], got {level}")
    return level


def registered(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a study's file says of its preregistration, as `Study` takes it.

    Examples
    --------
    >>> registered({"name": "a"})
    {'registered': '', 'planned_seeds': None, 'registration_holds': True}
    """
    found, plan = str(data.get("registered") or ""), data.get("preregistration")
    planned = plan.get("planned_seeds") if isinstance(plan, Mapping) else None
    return {
        "registered": found,
        "planned_seeds": planned if isinstance(planned, int) else None,
        "registration_holds": not found or registration(data) == found,
    }


def load_study(study_dir: Path) -> Study:
    """Load ``study.yaml`` and every run below it.

    Raises
    ------
    ResultsError
        If a file is corrupt, a key is missing or of the wrong type, two runs were evaluated at
        different steps, two runs of a task measured different things, a task has one representation
        twice, or no run is finished.
    """
    path = Path(study_dir) / "study.yaml"
    try:
        data = read_yaml(path)
    except ConfigError as error:
        reason = str(error).removeprefix(f"{path}: ")
        raise ResultsError(f"{path}: cannot be read: {reason}") from error
    where = str(path)
    entries = _key(data, "arms", list, where)
    arms = tuple(_load_arm(e, path.parent, f"{where}: arm {i}") for i, e in enumerate(entries))
    pairs = [(arm.task, arm.representation) for arm in arms]
    for pair in pairs:
        if pairs.count(pair) > 1:
            raise ResultsError(f"{where}: task '{pair[0]}' has representation '{pair[1]}' twice")
    done = [(run, evals) for arm in arms for run, evals in arm.done]
    if not done:
        raise ResultsError(f"{path.parent}: no finished run (a folder with a DONE file)")
    first, grid = done[0][0], done[0][1].env_steps
    for run, evals in done:
        if not np.array_equal(evals.env_steps, grid):
            raise ResultsError(
                f"{run.path / EVALS}: key 'env_steps' differs from that of {first.path}"
            )
    measured: dict[str, list[str]] = {}
    for arm in arms:
        for run, evals in arm.done:
            names = [metric.name for metric in evals.metrics]
            if names != measured.setdefault(arm.task, names):
                raise ResultsError(f"{run.path}: its metrics differ from other runs of {arm.task}")
    return Study(
        name=_key(data, "name", str, where),
        title=_key(data, "title", str, where),
        note=str(data.get("note") or ""),
        baseline=_key(data, "baseline", str, where),
        threshold=_threshold(data, where),
        tuning=str(data.get("tuning") or "unknown"),
        total_steps=_key(data, "total_steps", int, where),
        arms=arms,
        env_steps=grid,
        references=_load_references(path.parent / "references.json"),
        base=found if isinstance(found := data.get("base"), dict) else {},
        **registered(data),
    )
