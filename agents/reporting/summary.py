"""The numbers of a report: a summary of each arm, a comparison of each with the baseline.

The primary score of a run is its normalised AUC of the success rate over environment steps.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.metrics import Metric
from agents.reporting.bands import Band, bands
from agents.reporting.bootstrap import NO_INTERVAL, Array, Interval, bootstrap
from agents.reporting.results import Arm, Study
from agents.reporting.small_samples import ENOUGH, iqm_difference_t, iqm_t, mean_ratio_t, mean_t
from agents.reporting.statistics import (
    auc,
    holm,
    iqm_difference,
    iqm_interval,
    optimality_gap,
    probability_of_improvement,
    welch_p,
)
from agents.reporting.survival import (
    first_crossing,
    logrank_p,
    median_steps,
    restricted_mean_interval,
    speed_up,
    sustained_crossing,
)

ALL_TASKS = "all tasks"
SMOKE_SEEDS = 10  # fewer seeds than this: bootstrap intervals cover too little for a claim


@dataclass(frozen=True)
class Runs:
    """Per-run scores of one arm, failed runs as zeros; n = finished + failed runs."""

    auc: Array  # (n,)
    final_success: Array  # (n,)
    steps: Array  # (n,), to the first crossing of the threshold, censored at the budget
    reached: NDArray[np.bool_]  # (n,), where the threshold was reached
    sustained: Array  # (n,), to the crossing after which no evaluation falls below it
    stayed: NDArray[np.bool_]  # (n,), where there is one


@dataclass(frozen=True)
class ArmSummary:
    """Statistics of one arm; intervals are NO_INTERVAL where the arm has no run."""

    arm: Arm
    runs: Runs
    auc: Interval
    final_success: Interval
    gap: Interval  # optimality gap of the final success rate
    metrics: Mapping[str, Interval]  # final, by name, as people read them; finished runs only
    restricted_steps: Interval
    median_steps: float

    @property
    def n(self) -> int:
        """Runs that count: finished and failed."""
        return len(self.runs.auc)

    @property
    def reached(self) -> int:
        """Runs that reached the threshold."""
        return int(self.runs.reached.sum())

    @property
    def auc_sd(self) -> float:
        """Spread of the AUC across seeds, which more seeds do not shrink; NaN for one run."""
        return float(np.std(self.runs.auc, ddof=1)) if self.n > 1 else float("nan")


@dataclass(frozen=True)
class Comparison:
    """One representation against the baseline, on one task or over all tasks both ran on."""

    task: str
    representation: str
    baseline: str
    speed_up: Interval  # restricted mean steps baseline / representation: above 1 is faster
    auc_difference: Interval
    p_better: Interval
    reached: tuple[int, int]  # runs that reached the threshold: representation, baseline
    runs: tuple[int, int] = (0, 0)  # fewest runs of a task that count, likewise
    censored: tuple[int, int] = (0, 0)  # runs that did not
    sustained_speed_up: Interval = NO_INTERVAL  # by the crossings after which success stays
    never_stayed: tuple[int, int] = (0, 0)
    welch_p: float = float("nan")  # Holm-adjusted over the report's family of comparisons
    logrank_p: float = float("nan")

    @property
    def steps_ratio(self) -> Interval:
        """Fraction of the baseline's steps that the representation needs to cross first."""
        return _inverse(self.speed_up)

    @property
    def sustained_ratio(self) -> Interval:
        """Fraction of the baseline's steps that the representation needs to stay above."""
        return _inverse(self.sustained_speed_up)


def _inverse(ratio: Interval) -> Interval:
    with np.errstate(divide="ignore"):
        return Interval(*map(float, np.reciprocal([ratio.estimate, ratio.high, ratio.low])))


def bound(censored: tuple[int, int]) -> str:
    """Return what censored runs make of a ratio of steps, representation over baseline.

    Parameters
    ----------
    censored : (int, int)
        Runs of the representation and of the baseline that never got there. They count with the
        budget, which is less than they would need.

    Returns
    -------
    str
        "", "≥" (the true ratio is larger), "≤", or "?" where both arms have such runs.

    Examples
    --------
    >>> bound((0, 0)), bound((0, 3)), bound((2, 0)), bound((1, 1))
    ('', '≤', '≥', '?')
    """
    ours, theirs = (count > 0 for count in censored)
    return {(False, False): "", (False, True): "≤", (True, False): "≥", (True, True): "?"}[
        ours, theirs
    ]


@dataclass(frozen=True)
class Trend:
    """How the difference in AUC of a representation to the baseline grows over tasks "n = N"."""

    representation: str
    slope: Interval  # for each doubling of n


@dataclass(frozen=True)
class Summary:
    """All numbers of a report, and the bootstrap settings they came from."""

    study: Study
    arms: tuple[ArmSummary, ...]
    comparisons: tuple[Comparison, ...]
    pooled: tuple[Comparison, ...]  # over all tasks; empty for a single task
    reps: int
    seed: int
    trends: tuple[Trend, ...] = ()

    @cached_property
    def bands(self) -> tuple[Band, ...]:
        """Learning curves of every arm, drawn by more than one figure."""
        return tuple(bands(self.study, seed=self.seed, reps=self.reps))

    @property
    def fewest_seeds(self) -> int:
        """Runs that count in the arm that has the fewest, of those that have any."""
        return min((arm.n for arm in self.arms if arm.n), default=0)

    @property
    def smoke(self) -> bool:
        """Whether there are too few seeds for a claim."""
        return self.fewest_seeds < SMOKE_SEEDS

    def find(self, task: str, representation: str) -> ArmSummary | None:
        """Summary of an arm that has runs, or None."""
        for s in self.arms:
            if (s.arm.task, s.arm.representation) == (task, representation) and s.n:
                return s
        return None


def _clipped(interval: Interval, low: float, high: float) -> Interval:
    """Return an interval whose ends are where scores can be."""
    ends = np.clip([interval.low, interval.high], low, high)
    return Interval(interval.estimate, *map(float, ends))


def summarise_arm(study: Study, arm: Arm, *, seed: int, reps: int) -> ArmSummary:
    """Compute the statistics of one arm."""
    success = study.success(arm)
    grid, level = study.env_steps, study.threshold
    steps, reached = first_crossing(grid, success, level)
    sustained, stayed = sustained_crossing(grid, success, level)
    runs = Runs(auc(grid, success), success[:, -1], steps, reached, sustained, stayed)

    def over(scores: Array, within: tuple[float, float] = (-np.inf, np.inf)) -> Interval:
        if not len(scores):
            return NO_INTERVAL
        if len(scores) < ENOUGH:
            return _clipped(iqm_t(scores), *within)
        return iqm_interval([scores], seed=seed, reps=reps)

    def measured(metric: Metric) -> Interval:
        scores = study.curves(arm, metric)[:, -1]
        return over(scores, (metric.least(scores), np.inf))

    some = len(success) > 0
    steps_interval = NO_INTERVAL
    if some and len(steps) < ENOUGH:
        steps_interval = _clipped(mean_t(steps), 0.0, float(grid[-1]))
    elif some:
        steps_interval = restricted_mean_interval([steps], seed=seed, reps=reps)
    return ArmSummary(
        arm=arm,
        runs=runs,
        auc=over(runs.auc, (0.0, 1.0)),
        final_success=over(runs.final_success, (0.0, 1.0)),
        gap=optimality_gap([runs.final_success], seed=seed, reps=reps) if some else NO_INTERVAL,
        metrics={m.name: measured(m) for m in arm.metrics},
        restricted_steps=steps_interval,
        median_steps=median_steps(steps, reached) if some else float("nan"),
    )


def _compare(
    task: str, pairs: Sequence[tuple[ArmSummary, ArmSummary]], *, seed: int, reps: int
) -> Comparison:
    """Compare (representation, baseline) pairs, one for each task."""
    other, base = [[pair[i].runs for pair in pairs] for i in (0, 1)]
    aucs = [runs.auc for runs in other], [runs.auc for runs in base]
    few = len(pairs) == 1 and min(len(aucs[0][0]), len(aucs[1][0])) < ENOUGH
    units = tuple([pair[i].arm.seeds for pair in pairs] for i in (0, 1))
    settings: Any = {"seed": seed, "reps": reps, "units": units}

    def faster(ours: list[Array], theirs: list[Array]) -> Interval:
        if few:
            return mean_ratio_t(theirs[0], ours[0])
        return speed_up(theirs, ours, **(settings | {"units": units[::-1]}))

    def missed(of: Callable[[Runs], NDArray[np.bool_]]) -> tuple[int, int]:
        return tuple(int(sum((~of(r)).sum() for r in arm)) for arm in (other, base))  # type: ignore[return-value]

    return Comparison(
        task=task,
        representation=pairs[0][0].arm.representation,
        baseline=pairs[0][1].arm.representation,
        speed_up=faster([r.steps for r in other], [r.steps for r in base]),
        auc_difference=iqm_difference_t(aucs[0][0], aucs[1][0])
        if few
        else iqm_difference(*aucs, **settings),
        p_better=probability_of_improvement(*aucs, **settings),
        reached=(sum(p[0].reached for p in pairs), sum(p[1].reached for p in pairs)),
        runs=(min(p[0].n for p in pairs), min(p[1].n for p in pairs)),
        censored=missed(lambda r: r.reached),
        sustained_speed_up=faster([r.sustained for r in other], [r.sustained for r in base]),
        never_stayed=missed(lambda r: r.stayed),
    )


def _with_tests(
    comparisons: list[Comparison], pairs: list[tuple[ArmSummary, ArmSummary]]
) -> tuple[Comparison, ...]:
    """Add the p-values of both tests, each family adjusted by Holm."""
    welch = holm([welch_p(x.runs.auc, y.runs.auc) for x, y in pairs])
    logrank = holm(
        [logrank_p(x.runs.steps, x.runs.reached, y.runs.steps, y.runs.reached) for x, y in pairs]
    )
    return tuple(
        replace(c, welch_p=float(w), logrank_p=float(p))
        for c, w, p in zip(comparisons, welch, logrank, strict=True)
    )


def summarise(study: Study, *, seed: int, reps: int) -> Summary:
    """Compute every number of a report.

    Parameters
    ----------
    study : Study
        Loaded runs.
    seed, reps : int
        Seed and number of replications of every bootstrap.
    """
    arms = tuple(
        summarise_arm(study, arm, seed=seed, reps=reps)
        for task in study.tasks
        for arm in study.of_task(task)
    )
    summary = Summary(study, arms, (), (), reps, seed)
    pairs = [
        (s, base)
        for s in arms
        if s.n and s.arm.representation != study.baseline
        if (base := summary.find(s.arm.task, study.baseline)) is not None
    ]
    single = [_compare(x.arm.task, [(x, y)], seed=seed, reps=reps) for x, y in pairs]
    pooled = []
    if len(study.tasks) > 1:
        for name in study.representations:
            shared = [pair for pair in pairs if pair[0].arm.representation == name]
            if len(shared) > 1:
                pooled.append(_compare(ALL_TASKS, shared, seed=seed, reps=reps))
    return replace(
        summary,
        comparisons=_with_tests(single, pairs),
        pooled=tuple(pooled),
        trends=tuple(_trends(study, pairs, seed=seed, reps=reps)),
    )


_COUNT = re.compile(r"n = ([0-9]+)")


def _trends(
    study: Study, pairs: list[tuple[ArmSummary, ArmSummary]], *, seed: int, reps: int
) -> Iterator[Trend]:
    """Yield slopes over log2(n) where tasks are labelled "n = N"; seeds stay together."""
    for name in study.representations:
        shared = [
            (int(match[1]), x, y)
            for x, y in pairs
            if x.arm.representation == name and (match := _COUNT.fullmatch(x.arm.task))
        ]
        if len(shared) < 3:
            continue
        doublings = np.log2([n for n, _, _ in shared])
        away = doublings - doublings.mean()
        weights = away / (away @ away)

        def slope(ours: list[Array], theirs: list[Array], weights: Array = weights) -> Array:
            means = [x.mean(axis=1) - y.mean(axis=1) for x, y in zip(ours, theirs, strict=True)]
            return np.asarray(weights @ np.array(means))

        ours, theirs = [x for _, x, _ in shared], [y for _, _, y in shared]
        aucs = [[arm.runs.auc for arm in arms] for arms in (ours, theirs)]
        units = [[arm.arm.seeds for arm in arms] for arms in (ours, theirs)]
        yield Trend(name, bootstrap(slope, *aucs, seed=seed, reps=reps, units=units))
