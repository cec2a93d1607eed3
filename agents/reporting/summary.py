"""The numbers of a report: a summary of each arm, a comparison of each with the baseline.

The primary score of a run is its normalised AUC of the success rate over environment steps.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agents.reporting.bootstrap import NO_INTERVAL, Array, Interval
from agents.reporting.results import Arm, Study
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
)

ALL_TASKS = "all tasks"
SMOKE_SEEDS = 10  # fewer seeds than this: bootstrap intervals cover too little for a claim


@dataclass(frozen=True)
class Runs:
    """Per-run scores of one arm, failed runs as zeros; n = finished + failed runs."""

    auc: Array  # (n,)
    final_success: Array  # (n,)
    steps: Array  # (n,), censored at the budget
    reached: Array  # (n,), 1 where the threshold was reached


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
    welch_p: float = float("nan")  # Holm-adjusted over the report's family of comparisons
    logrank_p: float = float("nan")

    @property
    def steps_ratio(self) -> Interval:
        """Fraction of the baseline's steps that the representation needs."""
        with np.errstate(divide="ignore"):
            ends = np.reciprocal([self.speed_up.estimate, self.speed_up.high, self.speed_up.low])
        return Interval(*map(float, ends))


@dataclass(frozen=True)
class Summary:
    """All numbers of a report, and the bootstrap settings they came from."""

    study: Study
    arms: tuple[ArmSummary, ...]
    comparisons: tuple[Comparison, ...]
    pooled: tuple[Comparison, ...]  # over all tasks; empty for a single task
    reps: int
    seed: int

    @property
    def mean_seeds(self) -> float:
        """Mean number of runs that count, over arms."""
        return float(np.mean([arm.n for arm in self.arms]))

    @property
    def smoke(self) -> bool:
        """Whether there are too few seeds for a claim."""
        return self.mean_seeds < SMOKE_SEEDS

    def find(self, task: str, representation: str) -> ArmSummary | None:
        """Summary of an arm that has runs, or None."""
        for s in self.arms:
            if (s.arm.task, s.arm.representation) == (task, representation) and s.n:
                return s
        return None


def summarise_arm(study: Study, arm: Arm, *, seed: int, reps: int) -> ArmSummary:
    """Compute the statistics of one arm."""
    success = study.success(arm)
    steps, reached = first_crossing(study.env_steps, success, study.threshold)
    runs = Runs(auc(study.env_steps, success), success[:, -1], steps, reached.astype(float))

    def over(scores: Array) -> Interval:
        return iqm_interval([scores], seed=seed, reps=reps) if len(scores) else NO_INTERVAL

    some = len(success) > 0
    return ArmSummary(
        arm=arm,
        runs=runs,
        auc=over(runs.auc),
        final_success=over(runs.final_success),
        gap=optimality_gap([runs.final_success], seed=seed, reps=reps) if some else NO_INTERVAL,
        metrics={m.name: over(study.curves(arm, m)[:, -1]) for m in arm.metrics},
        restricted_steps=restricted_mean_interval([steps], seed=seed, reps=reps)
        if some
        else NO_INTERVAL,
        median_steps=median_steps(steps, reached) if some else float("nan"),
    )


def _compare(
    task: str, pairs: Sequence[tuple[ArmSummary, ArmSummary]], *, seed: int, reps: int
) -> Comparison:
    """Compare (representation, baseline) pairs, one for each task."""
    other, base = [[pair[i].runs for pair in pairs] for i in (0, 1)]
    aucs = [runs.auc for runs in other], [runs.auc for runs in base]
    return Comparison(
        task=task,
        representation=pairs[0][0].arm.representation,
        baseline=pairs[0][1].arm.representation,
        speed_up=speed_up([r.steps for r in base], [r.steps for r in other], seed=seed, reps=reps),
        auc_difference=iqm_difference(*aucs, seed=seed, reps=reps),
        p_better=probability_of_improvement(*aucs, seed=seed, reps=reps),
        reached=(sum(p[0].reached for p in pairs), sum(p[1].reached for p in pairs)),
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
    return replace(summary, comparisons=_with_tests(single, pairs), pooled=tuple(pooled))
