"""The reports in docs/results, written again from the curves that are committed beside them.

python -m benchmarks.committed_reports [STUDY ...]

Their statistics then are today's, whenever the runs were made. Figures that need every goal or the
wall clock stay as they were written beside the runs.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

from agents.files import TRIALS, write_bytes, write_text
from agents.reporting.bootstrap import REPS
from agents.reporting.committed import load_committed
from agents.reporting.report import table_page, write_study
from agents.reporting.summary import Summary, summarise
from agents.reporting.tuning import write_tuning
from agents.reporting.wording import steps_text, with_interval

RESULTS = Path(__file__).resolve().parent.parent / "docs" / "results"

KEPT = ("table.md", "table.csv", "forest.png", "report.html")
"""Files that follow from the curves alone."""


def rewrite(folder: Path) -> None:
    """Write the report of one study again, and its tables against other baselines."""
    study = load_committed(folder)
    with tempfile.TemporaryDirectory() as place:
        page = write_study(study, Path(place), kinds=("png",))
        for name in (name for name in KEPT if (folder / name).exists()):
            write_bytes(folder / name, (page.parent / name).read_bytes())
    if (folder / TRIALS).exists():
        arms = {arm.name: (arm.task, arm.representation) for arm in study.arms}
        write_tuning(folder, arms, ("png", "svg"))
    for other in folder.glob("against_*"):
        against = replace(study, baseline=other.name.removeprefix("against_"))
        write_text(other / "table.md", table_page(against))


@cache
def _summary(name: str, baseline: str) -> Summary:
    study = replace(load_committed(RESULTS / name), baseline=baseline)
    return summarise(study, seed=0, reps=REPS)


def row(name: str, score: str, arm: str, baseline: str) -> str:
    """Return a table row of a score of one arm against another, task by task, as pages show it.

    Parameters
    ----------
    name : str
        A folder of docs/results.
    score : {"AUC", "steps", "steps to stay"}
        Difference in AUC of success, or the ratio of steps to the first or the lasting crossing.
    arm, baseline : str
        Representations.
    """
    shown = {"raw": "raw", "clarke": "Clarke", "raw_scaled": "scaled raw"}
    cells = []
    for entry in _summary(name, baseline).comparisons:
        if entry.representation == arm:
            cells.append(
                {
                    "AUC": with_interval(entry.auc_difference, sign=True),
                    "steps": steps_text(entry.steps_ratio, entry.censored),
                    "steps to stay": steps_text(entry.sustained_ratio, entry.never_stayed),
                }[score]
            )
    sign = "−" if score == "AUC" else "/"
    return f"| {score}: {shown[arm]} {sign} {shown[baseline]} | {' | '.join(cells)} |"


ROWS = tuple(
    (name, score, arm, baseline)
    for name in ("headline", "headline_mujoco")
    for score, arm, baseline in (
        ("AUC", "clarke", "raw"),
        ("AUC", "raw_scaled", "raw"),
        ("AUC", "clarke", "raw_scaled"),
        ("steps", "clarke", "raw"),
        ("steps to stay", "clarke", "raw"),
        ("steps", "raw_scaled", "raw"),
        ("steps", "clarke", "raw_scaled"),
    )
) + tuple(
    (name, score, "clarke", "raw")
    for name in ("quick", "quick_mujoco")
    for score in ("AUC", "steps")
)
"""Rows of docs/results.md."""


def main() -> None:
    """Rewrite the studies that are named, or all."""
    names = sys.argv[1:] or [path.parent.name for path in sorted(RESULTS.glob("*/curves.csv"))]
    for name in names:
        rewrite(RESULTS / name)
        print(RESULTS / name)


if __name__ == "__main__":
    main()
