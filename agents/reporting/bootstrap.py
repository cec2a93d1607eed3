"""Stratified percentile bootstrap over training runs.

A *run* is one training seed. Scores of one arm come as *strata*: a sequence with one array of run
scores for each task. Runs are resampled with replacement inside their task, seeds alike in all, so
that a seed's runs stay together: they share their network's start and their goals, and in Clarke
coordinates tasks can be the very same, whose runs say one thing only. Where tasks have other seeds
(``units``), one sequence of seeds is drawn, of which each task takes those that it has.
Every arm is resampled independently of the others, which is conservative when the arms share goals.
Every function needs a ``seed`` and draws from a generator of its own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Strata: TypeAlias = Sequence[ArrayLike]
Statistic: TypeAlias = Callable[..., Array]
Units: TypeAlias = Sequence[Sequence[Sequence[int]]]
"""For each arm and task, which seed each run is of."""

REPS = 2000
LEVEL = 0.95


@dataclass(frozen=True)
class Interval:
    """A point estimate and its interval; both ends are NaN where too few runs allow none.

    Examples
    --------
    >>> Interval(0.3, 0.1, 0.5).excludes(0.0)
    True
    >>> Interval(0.3, float("nan"), float("nan")).known
    False
    """

    estimate: float
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether the interval has ends."""
        return not (np.isnan(self.low) or np.isnan(self.high))

    def excludes(self, value: float) -> bool:
        """Whether the interval is known and `value` lies strictly outside it."""
        return self.known and not self.low <= value <= self.high


NO_INTERVAL = Interval(float("nan"), float("nan"), float("nan"))


def _arm(strata: Strata) -> list[Array]:
    """Strata as arrays of shape (runs, ...), refused when empty."""
    arrays = [np.asarray(s, float) for s in strata]
    if not arrays or any(a.ndim == 0 or len(a) == 0 for a in arrays):
        raise ValueError("an arm needs at least one task and every task at least one run")
    return arrays


def _resampled(
    arm: list[Array], reps: int, rng: np.random.Generator, seeds: Sequence[Sequence[int]] | None
) -> list[Array]:
    if seeds is None or all(list(of_task) == list(seeds[0]) for of_task in seeds):
        picks = {n: rng.integers(n, size=(reps, n)) for n in dict.fromkeys(map(len, arm))}
        return [stratum[picks[len(stratum)]] for stratum in arm]
    everyone = sorted({seed for of_task in seeds for seed in of_task})
    places = np.full((len(arm), len(everyone)), -1)
    for task, of_task in enumerate(seeds):
        places[task, np.searchsorted(everyone, of_task)] = np.arange(len(of_task))
    drawn = rng.integers(len(everyone), size=(reps, 2 * len(everyone)))
    while (np.sum(places[:, drawn] >= 0, axis=2) < [[len(s)] for s in arm]).any():
        more = rng.integers(len(everyone), size=drawn.shape)
        drawn = np.concatenate([drawn, more], axis=1)
    taken = []
    for stratum, place in zip(arm, places[:, drawn], strict=True):
        first = np.argsort(place < 0, axis=1, kind="stable")[:, : len(stratum)]
        taken.append(stratum[np.take_along_axis(place, first, axis=1)])
    return taken


def bootstrap_band(
    statistic: Statistic,
    *arms: Strata,
    seed: int,
    reps: int = REPS,
    level: float = LEVEL,
    units: Units | None = None,
) -> tuple[Array, Array, Array]:
    """Pointwise percentile bootstrap of a statistic with any trailing shape, such as a curve.

    Parameters
    ----------
    statistic : callable
        Called as ``statistic(*arms)``, each arm a list over tasks of arrays (reps, runs, ...);
        returns shape (reps, ...).
    *arms : sequence of array_like, shape (runs, ...)
        One sequence of strata for each arm, runs in the order of their seeds; arms are resampled
        independently.
    seed : int
        Seed of the resampling.
    reps : int
        Bootstrap replications.
    level : float
        Coverage aimed at.
    units : sequence of sequences of sequences of int, optional
        The seed of every run of every task of every arm; by default runs of equally many are taken
        to be of the same seeds.

    Returns
    -------
    estimate, low, high : ndarray, shape (...)
        The ends are NaN if any task of any arm has a single run.

    Raises
    ------
    ValueError
        If an arm has no task, a task has no run, or `reps` or `level` make no sense.

    Examples
    --------
    >>> estimate, low, high = bootstrap_band(lambda a: a[0].mean(axis=1), [[[1, 2]]], seed=0)
    >>> estimate.tolist(), low.tolist()
    ([1.0, 2.0], [nan, nan])
    """
    if reps < 1 or not 0 < level < 1:
        raise ValueError(f"need reps >= 1 and 0 < level < 1, got reps={reps}, level={level}")
    data = [_arm(strata) for strata in arms]
    estimate = statistic(*([s[None] for s in arm] for arm in data))[0]
    if min(len(s) for arm in data for s in arm) < 2:  # one run says nothing about its spread
        return estimate, np.full_like(estimate, np.nan), np.full_like(estimate, np.nan)
    rng = np.random.default_rng(seed)
    known = [None] * len(data) if units is None else list(units)
    draws = statistic(*(_resampled(a, reps, rng, u) for a, u in zip(data, known, strict=True)))
    tail = (1 - level) / 2
    # An order statistic instead of interpolation: also right for infinite ratios.
    low, high = np.quantile(draws, [tail, 1 - tail], axis=0, method="inverted_cdf")
    return estimate, low, high


def bootstrap(
    statistic: Statistic,
    *arms: Strata,
    seed: int,
    reps: int = REPS,
    level: float = LEVEL,
    units: Units | None = None,
) -> Interval:
    """As `bootstrap_band`, for a scalar statistic: `statistic` returns shape (reps,).

    Examples
    --------
    >>> bootstrap(lambda arm: arm[0].mean(axis=1), [[1.0, 1.0, 1.0]], seed=0)
    Interval(estimate=1.0, low=1.0, high=1.0)
    """
    band = bootstrap_band(statistic, *arms, seed=seed, reps=reps, level=level, units=units)
    return Interval(*map(float, band))
