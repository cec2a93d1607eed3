"""Scores of committed studies, and how pages write them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from agents.reporting.bootstrap import Array, Interval
from agents.reporting.committed import load_committed
from agents.reporting.results import Study
from agents.reporting.small_samples import mean_ratio_t
from agents.reporting.statistics import auc
from agents.reporting.survival import first_crossing
from agents.reporting.tables import markdown
from agents.reporting.wording import steps_text, with_interval

DOCS = Path(__file__).resolve().parent.parent / "docs"


@dataclass(frozen=True)
class Runs:
    """Scores of one arm's runs."""

    auc: Array
    steps: Array  # to the first crossing of the threshold, the budget where there is none
    reached: int
    final_error_mm: Array
    last_success: Array  # mean of the last five evaluations

    @property
    def missed(self) -> int:
        """Runs that did not come to the threshold."""
        return len(self.auc) - self.reached


@cache
def committed(study: str) -> Study:
    """Return a study of docs/results."""
    return load_committed(DOCS / "results" / study)


@cache
def runs(study: str, since: int = 0) -> dict[tuple[str, str], Runs]:
    """Return the scores of a committed study by (task, arm), of its seeds from `since` on."""
    loaded = committed(study)
    found = {}
    for whole in loaded.arms:
        arm = replace(whole, runs=tuple(run for run in whole.runs if run.seed >= since))
        if not arm.done:
            continue
        success = loaded.success(arm)
        steps, reached = first_crossing(loaded.env_steps, success, loaded.threshold)
        errors = loaded.curves(arm, arm.metrics[0])[:, -1]
        found[arm.task, arm.representation] = Runs(
            auc(loaded.env_steps, success),
            steps,
            int(reached.sum()),
            errors,
            success[:, -5:].mean(axis=1),
        )
    return found


def registered(study: str) -> str:
    """Return the first digits of the hash of what was preregistered."""
    return committed(study).registered[:12]


def seeds(arms: Iterable[Runs]) -> str:
    """Return the number of seeds an arm, a range where it differs."""
    counts = sorted({len(scores.auc) for scores in arms})
    return str(counts[0]) if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"


def steps_over(ours: Runs, theirs: Runs) -> str:
    """Return a ratio of steps with its interval, as a bound where runs did not get there."""
    if not ours.reached and not theirs.reached:
        return "neither there"
    ratio = mean_ratio_t(ours.steps, theirs.steps)
    return steps_text(ratio, (ours.missed, theirs.missed))


def signed(interval: Interval) -> str:
    """Return a difference in AUC with its interval."""
    return with_interval(interval, 3, sign=True)


def p_text(p: float) -> str:
    """Return a p-value.

    Examples
    --------
    >>> p_text(0.2), p_text(0.0002)
    ('0.200', '< 0.001')
    """
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def plain_table(rows: list[list[str]]) -> str:
    """Return a Markdown table with nothing escaped: pages hold no words of strangers."""
    text = markdown(rows)
    for escaped, meant in (("\\[", "["), ("\\]", "]"), ("\\`", "`"), ("&lt;", "<")):
        text = text.replace(escaped, meant)
    return text
