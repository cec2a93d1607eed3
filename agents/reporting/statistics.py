"""Statistics of learning runs: AUC, interquartile mean, probability of improvement, tests.

Source: Agarwal et al., "Deep reinforcement learning at the edge of the statistical precipice",
NeurIPS 2021. Intervals come from the stratified bootstrap of `agents.reporting.bootstrap`, whose
words (*run*, *strata*) and arguments (`seed`, `reps`, `level`) are used here.
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from agents.metrics import auc as auc
from agents.reporting.bootstrap import (
    LEVEL,
    REPS,
    Array,
    Interval,
    Strata,
    Units,
    bootstrap,
    bootstrap_band,
)


def iqm(scores: ArrayLike, axis: int = -1) -> Array:
    """Interquartile mean: the mean after dropping a quarter of the runs at either end.

    With n runs, floor(n / 4) are dropped at each end, so fewer than four runs give the plain mean.

    Examples
    --------
    >>> float(iqm([0.0, 2.0, 4.0, 100.0]))
    3.0
    """
    return np.asarray(stats.trim_mean(np.asarray(scores, float), 0.25, axis=axis))


def _pooled_iqm(arm: list[Array]) -> Array:
    return iqm(np.concatenate(arm, axis=1), axis=1)


def _weighed_iqm(arm: list[Array]) -> Array:
    """Return the mean of the tasks' IQMs, in which each weighs alike whatever its runs are."""
    return np.asarray(np.mean([iqm(stratum, axis=1) for stratum in arm], axis=0))


def _pooled_mean(arm: list[Array]) -> Array:
    return np.asarray(np.concatenate(arm, axis=1).mean(axis=1))


def iqm_interval(strata: Strata, *, seed: int, reps: int = REPS, level: float = LEVEL) -> Interval:
    """IQM over all runs of all tasks with its stratified bootstrap interval.

    Examples
    --------
    >>> iqm_interval([[0.0, 2.0, 4.0, 100.0]], seed=0).estimate
    3.0
    """
    return bootstrap(_pooled_iqm, strata, seed=seed, reps=reps, level=level)


def iqm_difference(
    x: Strata,
    y: Strata,
    *,
    seed: int,
    reps: int = REPS,
    level: float = LEVEL,
    units: Units | None = None,
) -> Interval:
    """IQM of arm `x` minus IQM of arm `y`, with the interval of that difference.

    Over all runs of all tasks; where an arm has more runs of one task than of another, the mean of
    the tasks' IQMs instead, or the arm with more runs of the easy task would win.

    Examples
    --------
    >>> iqm_difference([[3.0, 3.0]], [[1.0, 1.0]], seed=0)
    Interval(estimate=2.0, low=2.0, high=2.0)
    >>> iqm_difference([[0.9], [0.1] * 9], [[0.9] * 9, [0.1]], seed=0).estimate
    0.0
    """
    equal = all(len({len(np.asarray(task)) for task in arm}) == 1 for arm in (x, y))
    of = _pooled_iqm if equal else _weighed_iqm

    def difference(a: list[Array], b: list[Array]) -> Array:
        return of(a) - of(b)

    return bootstrap(difference, x, y, seed=seed, reps=reps, level=level, units=units)


def curve_band(
    curves: ArrayLike,
    *,
    seed: int,
    mean: bool = False,
    reps: int = REPS,
    level: float = LEVEL,
) -> tuple[Array, Array, Array]:
    """Centre and pointwise bootstrap band of the runs' curves; whole runs are resampled.

    Parameters
    ----------
    curves : array_like, shape (runs, E)
        One curve for each run.
    seed, reps, level
        As in `agents.reporting.bootstrap.bootstrap_band`.
    mean : bool
        Use the mean over runs (performance profiles) instead of the IQM (learning curves).

    Returns
    -------
    centre, low, high : ndarray, shape (E,)
        The band is NaN for a single run.

    Examples
    --------
    >>> centre, low, high = curve_band([[0.0, 1.0], [0.0, 3.0]], seed=0)
    >>> centre.tolist(), low.tolist(), high.tolist()
    ([0.0, 2.0], [0.0, 1.0], [0.0, 3.0])
    """
    statistic = _pooled_mean if mean else _pooled_iqm
    return bootstrap_band(statistic, [curves], seed=seed, reps=reps, level=level)


SAME = 12
"""Digits to which scores that differ are told apart: two sums of the same fractions differ in the
last bits."""


def _improvement(x: list[Array], y: list[Array]) -> Array:
    """P(X > Y) averaged over tasks; tasks weigh alike whatever their number of runs."""
    if len(x) != len(y):
        raise ValueError(f"the arms have {len(x)} and {len(y)} tasks")
    wins = [
        np.sign((a[:, :, None] - b[:, None, :]).round(SAME)).mean(axis=(1, 2))
        for a, b in zip(x, y, strict=True)
    ]
    return np.asarray(0.5 + 0.5 * np.mean(wins, axis=0))


def probability_of_improvement(
    x: Strata,
    y: Strata,
    *,
    seed: int,
    reps: int = REPS,
    level: float = LEVEL,
    units: Units | None = None,
) -> Interval:
    """Probability that a random run of `x` beats one of `y` on the same task, ties counting half.

    Averaged over tasks; the Mann-Whitney U statistic divided by the number of pairs.

    Raises
    ------
    ValueError
        If the arms differ in their number of tasks, or an arm is empty.

    Examples
    --------
    >>> probability_of_improvement([[1.0, 2.0]], [[0.0, 2.0]], seed=0).estimate
    0.625
    """
    return bootstrap(_improvement, x, y, seed=seed, reps=reps, level=level, units=units)


def optimality_gap(
    strata: Strata, *, seed: int, target: float = 1.0, reps: int = REPS, level: float = LEVEL
) -> Interval:
    """Mean shortfall below `target`, scores above it counting as on target; lower is better.

    Examples
    --------
    >>> round(optimality_gap([[0.5, 1.2]], seed=0).estimate, 12)
    0.25
    """

    def gap(arm: list[Array]) -> Array:
        return np.maximum(target - np.concatenate(arm, axis=1), 0).mean(axis=1)

    return bootstrap(gap, strata, seed=seed, reps=reps, level=level)


def performance_profile(errors: ArrayLike, levels: ArrayLike) -> Array:
    """Fraction of each run's errors at or below each level; an infinite error never counts.

    Parameters
    ----------
    errors : array_like, shape (runs, G)
        Errors of every run on G goals.
    levels : array_like, shape (L,)
        Levels to compare with.

    Returns
    -------
    ndarray, shape (runs, L)
        Rises along the levels.

    Examples
    --------
    >>> performance_profile([[1.0, 3.0]], [0.0, 1.0, 5.0]).tolist()
    [[0.0, 0.5, 1.0]]
    """
    e, tau = np.asarray(errors, float), np.asarray(levels, float)
    return np.asarray((e[:, :, None] <= tau).mean(axis=1))


def welch_p(x: ArrayLike, y: ArrayLike) -> float:
    """Two-sided p-value of Welch's t-test; NaN with fewer than two runs or no spread at all.

    Examples
    --------
    >>> round(welch_p([1.0, 2.0, 3.0], [2.0, 3.0, 4.0]), 4)
    0.2879
    """
    a, b = np.asarray(x, float), np.asarray(y, float)
    if min(a.size, b.size) < 2 or (np.ptp(a) == 0 and np.ptp(b) == 0):
        return float("nan")
    sides = [part for s in (a, b) for part in (s.mean(), s.std(ddof=1), s.size)]
    return float(stats.ttest_ind_from_stats(*sides, equal_var=False).pvalue)


def holm(p_values: ArrayLike) -> Array:
    """Holm's step-down adjustment of a family of p-values; NaN stays NaN and leaves the family.

    Source: Holm, "A simple sequentially rejective multiple test procedure", 1979.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03]).round(4).tolist()
    [0.03, 0.06, 0.06]
    """
    p = np.asarray(p_values, float)
    known = np.flatnonzero(~np.isnan(p))
    order = known[np.argsort(p[known], kind="stable")]
    adjusted = np.full(p.shape, np.nan)
    factors = np.arange(order.size, 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * p[order]), 1)
    return adjusted
