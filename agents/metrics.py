"""Metrics of a run as people read them: recorded beside its results, read by the report.

A task declares its metrics once (`clarke_gym.tasks.base.Metric`). A run folder keeps the
declaration in ``metrics.json``, so that its readers need neither the task nor the environment.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FILE = "metrics.json"

SHOWN_UNITS = {"m": ("mm", 1e3)}
"""SI unit -> the unit that people read, and how many of it make one."""

_SUFFIXES = {"m": "m", "percent": "%", "rad": "rad", "s": "s"}


@dataclass(frozen=True)
class Metric:
    """A metric as its task declares it, with the unit that people read.

    Examples
    --------
    >>> metric = Metric("tip_error_m", "tip error", "m", 0.4)
    >>> metric.shown_name, metric.shown_unit, metric.factor
    ('tip_error_mm', 'mm', 1000.0)
    >>> metric.with_unit(), Metric("laps", "laps", "", 0.0).with_unit()
    ('tip error [mm]', 'laps')
    """

    name: str
    label: str
    unit: str
    worst: float

    @property
    def shown_unit(self) -> str:
        """Unit that people read."""
        return SHOWN_UNITS.get(self.unit, (self.unit, 1.0))[0]

    @property
    def factor(self) -> float:
        """What a value is multiplied by to be shown."""
        return SHOWN_UNITS.get(self.unit, (self.unit, 1.0))[1]

    @property
    def shown_name(self) -> str:
        """Name of a column of shown values; a suffix says the unit where it is another one."""
        if self.shown_unit == self.unit:
            return self.name
        return f"{self.name.removesuffix(f'_{self.unit}')}_{self.shown_unit}"

    def least(self, scores: ArrayLike) -> float:
        """Return the smallest value that there can be: 0 where neither worst nor a score is less.

        Examples
        --------
        >>> error, gap = Metric("e_m", "error", "m", 0.4), Metric("gap_m", "gap", "m", -1.0)
        >>> error.least([0.0, 0.2]), error.least([-0.1, 0.2]), gap.least([0.1, 0.2])
        (0.0, -inf, -inf)
        """
        positive = math.isfinite(self.worst) and self.worst >= 0.0
        return 0.0 if positive and np.min(scores, initial=0.0) >= 0.0 else -math.inf

    def rises(self, shown: ArrayLike) -> bool:
        """Return whether larger values are better, by where the worst lies among shown ones.

        Examples
        --------
        >>> held, error = Metric("held", "time held", "", 0.0), Metric("e_m", "error", "m", 0.4)
        >>> held.rises([0.0, 0.0, 0.0, 0.7]), error.rises([400.0, 400.0, 3.0])
        (True, False)
        """
        values, worst = np.asarray(shown, float), self.factor * self.worst
        return bool(worst < np.median(values) or worst == values.min() < values.max())

    def with_unit(self, form: str = " [{}]") -> str:
        """Return the label, followed by the unit if there is one."""
        return self.label + (form.format(self.shown_unit) if self.unit else "")

    @classmethod
    def from_name(cls, name: str) -> Metric:
        """Return what a name alone tells: an error whose unit is the suffix.

        Examples
        --------
        >>> Metric.from_name("tip_error_m")
        Metric(name='tip_error_m', label='tip error', unit='m', worst=inf)
        """
        stem, _, suffix = name.rpartition("_")
        known = bool(stem) and suffix in _SUFFIXES
        label = (stem if known else name).replace("_", " ")
        return cls(name, label, _SUFFIXES[suffix] if known else "", float("inf"))


def auc(env_steps: ArrayLike, curves: ArrayLike) -> NDArray[np.float64]:
    """Area under curves divided by the range of steps: the mean height, in the curve's own unit.

    Parameters
    ----------
    env_steps : array_like, shape (E,)
        Strictly increasing environment steps of the E >= 2 evaluations.
    curves : array_like, shape (..., E)
        Scores at those steps.

    Returns
    -------
    ndarray, shape (...)
        Trapezoidal mean; in [0, 1] for success rates.

    Raises
    ------
    ValueError
        If the steps do not increase or the shapes do not fit.

    Examples
    --------
    >>> float(auc([0, 10, 20], [0.0, 1.0, 1.0]))
    0.75
    """
    x, y = np.asarray(env_steps, float), np.asarray(curves, float)
    if x.ndim != 1 or x.size < 2 or not (np.diff(x) > 0).all():
        raise ValueError("env_steps must be one-dimensional and strictly increasing, two or more")
    if y.shape[-1:] != x.shape:
        raise ValueError(f"curves end in shape {y.shape[-1:]}, env_steps has shape {x.shape}")
    return np.asarray(np.trapezoid(y, x, axis=-1) / (x[-1] - x[0]))


def metrics_text(declared: Iterable[Any]) -> str:
    """Return what ``metrics.json`` holds, the leading metric first."""
    return json.dumps([asdict(metric) for metric in declared], indent=2) + "\n"


def metrics_by_task_text(declared: Mapping[str, Iterable[Any]]) -> str:
    """Return what the ``metrics.json`` of a report holds: what each task declares, by its label."""
    tasks = {task: [asdict(metric) for metric in metrics] for task, metrics in declared.items()}
    return json.dumps(tasks, indent=2) + "\n"


def read_metrics_by_task(path: Path) -> dict[str, tuple[Metric, ...]]:
    """Return the metrics that the ``metrics.json`` of a report declares; none without the file.

    Raises
    ------
    OSError, ValueError, TypeError, AttributeError
        If the file does not hold metrics.
    """
    if not path.exists():
        return {}
    tasks = json.loads(path.read_text(encoding="utf-8")).items()
    return {task: tuple(Metric(**entry) for entry in metrics) for task, metrics in tasks}


def read_metrics(path: Path) -> tuple[Metric, ...]:
    """Return the metrics that a ``metrics.json`` declares.

    Raises
    ------
    OSError, ValueError, TypeError
        If the file is missing or does not hold metrics.
    """
    metrics = tuple(Metric(**entry) for entry in json.loads(path.read_text(encoding="utf-8")))
    if not metrics:
        raise ValueError("no metric is declared")
    return metrics
