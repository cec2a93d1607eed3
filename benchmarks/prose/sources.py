"""The committed result files that sentences are computed from."""

from __future__ import annotations

import csv
from functools import cache

from agents.reporting.bootstrap import NO_INTERVAL, Interval
from agents.reporting.wording import number, with_interval
from benchmarks.committed_scores import DOCS
from benchmarks.validation.common import Row, read


@cache
def _table(study: str) -> dict[tuple[str, str], dict[str, str]]:
    path = DOCS / "results" / study / "table.csv"
    with path.open(encoding="utf-8", newline="") as file:
        return {(row["task"], row["representation"]): row for row in csv.DictReader(file)}


def arm(study: str, task: str, representation: str, score: str) -> Interval:
    """Return a score of one arm of a committed study, or of its comparison with the baseline.

    Parameters
    ----------
    study : str
        Folder of docs/results.
    task, representation : str
        Row of its table; "steps" and "steps_to_stay" are fractions of the baseline's steps.
    score : str
        A column of table.csv that has an interval.
    """
    row = _table(study)[task, representation]
    name = {"steps": "speed_up", "steps_to_stay": "sustained_speed_up"}.get(score, score)
    estimate, *ends = (row[name + end] for end in ("", "_low", "_high"))
    if not all(ends):
        return Interval(float(estimate), NO_INTERVAL.low, NO_INTERVAL.high)
    low, high = map(float, ends)
    if name != score:
        return Interval(1.0 / float(estimate), 1.0 / high, 1.0 / low)
    return Interval(float(estimate), low, high)


def text(study: str, task: str, representation: str, score: str) -> str:
    """Return a score as pages write it: with its interval, differences with their sign."""
    return with_interval(arm(study, task, representation, score), sign="difference" in score)


def count(study: str, task: str, representation: str, column: str) -> int:
    """Return a whole number of a study's table."""
    return int(_table(study)[task, representation][column])


@cache
def _validation() -> list[Row]:
    return read(DOCS / "validation" / "results.csv")


def validated(part: str, case: str, conditions: str = "", unit: str = "") -> list[float]:
    """Return the values of a part of the validation whose case and conditions start so."""
    found = [
        row.value
        for row in _validation()
        if row.part == part
        and row.case.startswith(case)
        and row.conditions.startswith(conditions)
        and unit in ("", row.unit)
    ]
    if not found:
        raise KeyError(f"no row of the validation is {part}, {case}, {conditions}")
    return found


@cache
def rows(page: str) -> list[dict[str, str]]:
    """Return the rows of all tables of a page that a script has written, by column."""
    found: list[dict[str, str]] = []
    head: list[str] = []
    for line in (DOCS / page).read_text(encoding="utf-8").splitlines():
        if not line.startswith("|"):
            head = []
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if not head:
            head = cells
        elif not set(line) <= set("|-: "):
            found.append(dict(zip(head, cells, strict=True)))
    return found


def span(values: list[float], digits: int = 2) -> str:
    """Return the smallest and the largest of some numbers.

    Examples
    --------
    >>> span([0.5, 0.25]), span([0.5, 0.501])
    ('0.25 to 0.50', '0.50')
    """
    ends = [number(end, digits) for end in (min(values), max(values))]
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)
