"""Steps to a threshold, right-censored at the step budget.

A run that never reaches the threshold is not dropped: it is known only to need more than the
budget. Hence Kaplan-Meier curves, and the *restricted mean*, the area under the survival curve up
to the budget, instead of the mean of the runs that happened to finish.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from agents.reporting.bootstrap import LEVEL, REPS, Array, Interval, Strata, Units, bootstrap


def first_crossing(
    env_steps: ArrayLike, curves: ArrayLike, threshold: float
) -> tuple[Array, NDArray[np.bool_]]:
    """First evaluation at which each curve is at or above the threshold.

    The *first* crossing counts, even if the curve falls back later, and it is known only to the
    spacing of the evaluations (no interpolation between them).

    Parameters
    ----------
    env_steps : array_like, shape (E,)
        Environment steps of the evaluations.
    curves : array_like, shape (runs, E)
        One curve for each run.
    threshold : float
        Value to reach.

    Returns
    -------
    steps : ndarray, shape (runs,)
        Step of the crossing, or the budget ``env_steps[-1]`` where there is none.
    reached : ndarray of bool, shape (runs,)
        False where the run is censored at the budget.

    Examples
    --------
    >>> steps, reached = first_crossing([0, 10, 20], [[0, 0.9, 0.5], [0, 0, 0]], 0.9)
    >>> steps.tolist(), reached.tolist()
    ([10.0, 20.0], [True, False])
    """
    x, above = np.asarray(env_steps, float), np.asarray(curves, float) >= threshold
    if above.ndim != 2 or above.shape[1] != x.size:
        raise ValueError(f"curves must have shape (runs, {x.size}), got {above.shape}")
    reached: NDArray[np.bool_] = np.any(above, axis=1)
    return np.where(reached, x[above.argmax(axis=1)], x[-1]), reached


def sustained_crossing(
    env_steps: ArrayLike, curves: ArrayLike, threshold: float
) -> tuple[Array, NDArray[np.bool_]]:
    """First evaluation from which on each curve stays at or above the threshold.

    Parameters and returns are those of `first_crossing`; a curve that is below at the last
    evaluation never got there.

    Examples
    --------
    >>> curves = [[0, 0.9, 0.5, 0.9], [0, 0.9, 0.9, 1.0], [0, 0.9, 0.9, 0.8]]
    >>> steps, reached = sustained_crossing([0, 10, 20, 30], curves, 0.9)
    >>> steps.tolist(), reached.tolist()
    ([30.0, 10.0, 30.0], [True, True, False])
    """
    above = np.asarray(curves, float) >= threshold
    to_the_end = np.minimum.accumulate(above[:, ::-1], axis=1)[:, ::-1]
    return first_crossing(env_steps, to_the_end, 1.0)


def _censored(steps: ArrayLike, reached: ArrayLike) -> stats.CensoredData:
    return stats.CensoredData.right_censored(
        np.asarray(steps, float), ~np.asarray(reached, dtype=bool)
    )


def survival_curve(steps: ArrayLike, reached: ArrayLike) -> tuple[Array, Array]:
    """Kaplan-Meier estimate of the fraction of runs that still have not reached the threshold.

    Parameters
    ----------
    steps, reached : array_like, shape (runs,)
        As returned by `first_crossing`; censoring may fall anywhere.

    Returns
    -------
    times, survival : ndarray, shape (K,)
        A right-continuous step function that starts at (0, S(0)).

    Source: Kaplan and Meier, "Nonparametric estimation from incomplete observations", 1958.

    Examples
    --------
    >>> times, survival = survival_curve([10, 20, 20], [True, True, False])
    >>> times.tolist(), survival.round(3).tolist()
    ([0.0, 10.0, 20.0], [1.0, 0.667, 0.333])
    """
    sf = stats.ecdf(_censored(steps, reached)).sf
    times = np.union1d([0.0], sf.quantiles)
    return times, np.asarray(sf.evaluate(times))


def restricted_mean(steps: ArrayLike, reached: ArrayLike, budget: float) -> float:
    """Area under the Kaplan-Meier curve from 0 to the budget: mean steps, at most the budget.

    Examples
    --------
    >>> restricted_mean([10, 20], [True, False], budget=20)
    15.0
    """
    times, survival = survival_curve(steps, reached)
    ends = np.minimum(np.append(times[1:], budget), budget)
    return float(np.sum(survival * np.maximum(ends - times, 0)))


def median_steps(steps: ArrayLike, reached: ArrayLike) -> float:
    """First step at which half of the runs have reached the threshold; infinite if never.

    Examples
    --------
    >>> median_steps([10, 20, 30], [True, True, False])
    20.0
    >>> median_steps([10, 30, 30], [True, False, False])
    inf
    """
    times, survival = survival_curve(steps, reached)
    below = times[survival <= 0.5 + 1e-9]  # the estimate is a product of rounded fractions
    return float(below[0]) if below.size else float("inf")


def _task_means(arm: list[Array]) -> Array:
    return np.asarray(np.mean([s.mean(axis=1) for s in arm], axis=0))


def restricted_mean_interval(
    steps: Strata, *, seed: int, reps: int = REPS, level: float = LEVEL
) -> Interval:
    """Restricted mean steps, averaged over tasks, with its bootstrap interval.

    Parameters
    ----------
    steps : sequence of array_like, shape (runs,)
        For each task the steps of `first_crossing`. As censoring happens at the budget only, the
        area under the survival curve is the plain mean of these steps.
    seed, reps, level
        As in `agents.reporting.bootstrap.bootstrap_band`.

    Examples
    --------
    >>> restricted_mean_interval([[10.0, 20.0]], seed=0).estimate
    15.0
    """
    return bootstrap(_task_means, steps, seed=seed, reps=reps, level=level)


def speed_up(
    baseline: Strata,
    other: Strata,
    *,
    seed: int,
    reps: int = REPS,
    level: float = LEVEL,
    units: Units | None = None,
) -> Interval:
    """Restricted mean steps of the baseline divided by those of the other arm; above 1 is faster.

    The inverse, with its ends swapped, is the fraction of the baseline's steps that the other arm
    needs. Two arms that both need no step at all are equally fast (ratio 1). Budgets must be equal.

    Examples
    --------
    >>> speed_up([[20.0, 20.0]], [[10.0, 10.0]], seed=0)
    Interval(estimate=2.0, low=2.0, high=2.0)
    """

    def ratio(a: list[Array], b: list[Array]) -> Array:
        top, bottom = _task_means(a), _task_means(b)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where((top == 0) & (bottom == 0), 1.0, top / bottom)

    return bootstrap(ratio, baseline, other, seed=seed, reps=reps, level=level, units=units)


def logrank_p(
    steps_x: ArrayLike, reached_x: ArrayLike, steps_y: ArrayLike, reached_y: ArrayLike
) -> float:
    """Two-sided log-rank p-value of two arms' steps to threshold; NaN where it is undefined.

    Examples
    --------
    >>> logrank_p([9, 9], [False, False], [9, 9], [False, False])
    nan
    """
    if not (np.any(reached_x) or np.any(reached_y)):
        return float("nan")
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(
            stats.logrank(_censored(steps_x, reached_x), _censored(steps_y, reached_y)).pvalue
        )
