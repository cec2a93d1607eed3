"""The learning curves of a study: centre and band over the seeds of every arm."""

from collections.abc import Iterator
from dataclasses import dataclass

from agents.metrics import Metric
from agents.reporting.bootstrap import Array
from agents.reporting.results import Arm, Study
from agents.reporting.statistics import curve_band


@dataclass(frozen=True)
class Band:
    """One quantity of one arm over the evaluations; `metric` is None for the success rate."""

    task: str
    representation: str
    metric: Metric | None
    curves: Array  # (runs, E)
    centre: Array  # (E,), IQM over the runs
    low: Array  # (E,), NaN for a single run
    high: Array


def bands(study: Study, *, seed: int, reps: int) -> Iterator[Band]:
    """Yield the success rate and the leading metric of every arm that has runs.

    Parameters
    ----------
    study : Study
        Loaded runs.
    seed, reps : int
        As in `agents.reporting.bootstrap.bootstrap_band`.
    """

    def band(arm: Arm, metric: Metric | None, curves: Array) -> Iterator[Band]:
        if len(curves):
            centre, low, high = curve_band(curves, seed=seed, reps=reps)
            yield Band(arm.task, arm.representation, metric, curves, centre, low, high)

    for task in study.tasks:
        metric = study.leading_of(task)
        for arm in study.of_task(task):
            yield from band(arm, None, study.success(arm))
            if metric and arm.metrics:
                yield from band(arm, metric, study.curves(arm, metric))
