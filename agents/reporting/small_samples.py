"""Intervals for fewer than `ENOUGH` runs, where a percentile bootstrap covers too little.

They estimate what the bootstrap's statistics estimate, with Student's distribution in the place of
resampling: Yuen (1974) for interquartile means, which are trimmed means, and the delta method on
the logarithm (log-t) for ratios of means. `benchmarks.interval_coverage` shows what they cover.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from agents.reporting.bootstrap import LEVEL, Array, Interval
from agents.reporting.statistics import iqm

ENOUGH = 20
"""Runs from which on the bootstrap is used."""

_TRIM = 0.25


def _spread(x: Array, trim: float) -> tuple[float, float]:
    """Return squared standard error and degrees of freedom of a trimmed mean."""
    n, cut = len(x), int(trim * len(x))
    ordered = np.sort(x)
    if cut:
        ordered[:cut], ordered[n - cut :] = ordered[cut], ordered[n - cut - 1]
    kept = n - 2 * cut
    return float(ordered.var(ddof=1)) * (n - 1) / (kept * (kept - 1)), kept - 1.0


def _welch(parts: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the standard error of a sum, and Welch's degrees of freedom."""
    total = sum(square for square, _ in parts)
    squares = sum(square**2 / freedom for square, freedom in parts)
    return total**0.5, (total**2 / squares if squares else 1.0)


def _around(estimate: float, parts: list[tuple[float, float]], level: float) -> Interval:
    error, freedom = _welch(parts)
    reach = float(stats.t.ppf(0.5 + level / 2, freedom)) * error
    return Interval(estimate, estimate - reach, estimate + reach)


def _runs(x: ArrayLike) -> Array:
    array = np.asarray(x, float)
    if array.ndim != 1 or not array.size:
        raise ValueError(f"an arm needs one score a run, one run or more; got {array.shape}")
    return array


def _unknown(estimate: float) -> Interval:
    return Interval(estimate, float("nan"), float("nan"))


def iqm_t(x: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Interquartile mean with Yuen's interval.

    Parameters
    ----------
    x : array_like, shape (runs,)
    level : float
        Coverage aimed at.

    Returns
    -------
    Interval
        Without ends for a single run.

    Raises
    ------
    ValueError
        If there is no run.

    Examples
    --------
    >>> found = iqm_t([1.0, 2.0, 3.0, 4.0])
    >>> found.estimate, round(found.low, 2)
    (2.5, -6.48)
    """
    return iqm_combination_t([x], [1.0], level=level)


def iqm_combination_t(
    arms: Sequence[ArrayLike], weights: Sequence[float], *, level: float = LEVEL
) -> Interval:
    """Weighted sum of the IQMs of independent arms, with the interval of Yuen and Welch.

    Parameters
    ----------
    arms : sequence of array_like, shape (runs,)
    weights : sequence of float
        One an arm; (1, -1) is a difference.
    level : float
        Coverage aimed at.

    Returns
    -------
    Interval
        Without ends where an arm has a single run.

    Raises
    ------
    ValueError
        If an arm has no run, or there are not as many weights as arms.

    Examples
    --------
    >>> iqm_combination_t([[1.0, 3.0], [5.0, 5.0], [2.0, 2.0]], [1.0, 1.0, -2.0]).estimate
    3.0
    """
    data = [_runs(x) for x in arms]
    estimate = float(sum(w * iqm(x) for x, w in zip(data, weights, strict=True)))
    if min(len(x) for x in data) < 2:
        return _unknown(estimate)
    spreads = [_spread(x, _TRIM) for x in data]
    parts = [(w**2 * square, k) for (square, k), w in zip(spreads, weights, strict=True)]
    return _around(estimate, parts, level)


def iqm_difference_t(x: ArrayLike, y: ArrayLike, *, level: float = LEVEL) -> Interval:
    """IQM of `x` minus IQM of `y` with the interval of Yuen and Welch.

    Parameters, returns and errors are those of `iqm_t`.

    Examples
    --------
    >>> iqm_difference_t([1.0, 2.0], [1.0, 2.0]).estimate
    0.0
    """
    return iqm_combination_t([x, y], [1.0, -1.0], level=level)


def mean_difference_t(x: ArrayLike, y: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Mean of `x` minus mean of `y`, with Welch's interval.

    Parameters, returns and errors are those of `iqm_t`.

    Examples
    --------
    >>> mean_difference_t([2.0, 2.0], [1.0, 1.0])
    Interval(estimate=1.0, low=1.0, high=1.0)
    """
    arms = _runs(x), _runs(y)
    gap = float(arms[0].mean() - arms[1].mean())
    if min(map(len, arms)) < 2:
        return _unknown(gap)
    return _around(gap, [_spread(arm, 0.0) for arm in arms], level)


def mean_t(x: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Mean of positive scores with the log-t interval, whose ends are positive as well.

    Parameters, returns and errors are those of `iqm_t`.

    Examples
    --------
    >>> mean_t([1.0, 1.0])
    Interval(estimate=1.0, low=1.0, high=1.0)
    """
    runs = _runs(x)
    mean = float(runs.mean())
    if len(runs) < 2 or not mean:
        return _unknown(mean)
    square, freedom = _spread(runs, 0.0)
    logs = _around(float(np.log(mean)), [(square / mean**2, freedom)], level)
    return Interval(mean, float(np.exp(logs.low)), float(np.exp(logs.high)))


def mean_ratio_t(x: ArrayLike, y: ArrayLike, *, level: float = LEVEL) -> Interval:
    """Mean of `x` over mean of `y`, with the log-t interval.

    Parameters
    ----------
    x, y : array_like, shape (runs,)
        Not negative. Two arms of zeros have the ratio 1.
    level : float
        Coverage aimed at.

    Returns
    -------
    Interval
        Without ends for a single run, or where a mean is 0.

    Examples
    --------
    >>> mean_ratio_t([2.0, 2.0], [1.0, 1.0])
    Interval(estimate=2.0, low=2.0, high=2.0)
    """
    a, b = _runs(x), _runs(y)
    top, bottom = float(a.mean()), float(b.mean())
    if not (top and bottom):
        return _unknown(1.0 if top == bottom else float("inf") if top else 0.0)
    if min(len(a), len(b)) < 2:
        return _unknown(top / bottom)
    parts = []
    for runs, mean in ((a, top), (b, bottom)):
        square, freedom = _spread(runs, 0.0)
        parts.append((square / mean**2, freedom))
    logs = _around(float(np.log(top / bottom)), parts, level)
    return Interval(top / bottom, float(np.exp(logs.low)), float(np.exp(logs.high)))
