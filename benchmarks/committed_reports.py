"""The reports in docs/results, written again from the curves that are committed beside them.

python -m benchmarks.committed_reports [STUDY ...]

Their statistics then are today's, whenever the runs were made. Figures that need every goal or the
wall clock stay as they were written beside the runs.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from agents.files import write_bytes, write_text
from agents.reporting.committed import load_committed
from agents.reporting.report import table_page, write_study

RESULTS = Path(__file__).resolve().parent.parent / "docs" / "results"

KEPT = ("table.md", "table.csv", "forest.png", "report.html")
"""Files that follow from the curves alone."""


def rewrite(folder: Path) -> None:
    """Write the report of one study again, and its tables against other baselines."""
    study = load_committed(folder)
    with tempfile.TemporaryDirectory() as place:
        page = write_study(study, Path(place))
        for name in KEPT:
            write_bytes(folder / name, (page.parent / name).read_bytes())
    for other in folder.glob("against_*"):
        against = replace(study, baseline=other.name.removeprefix("against_"))
        write_text(other / "table.md", table_page(against))


def main() -> None:
    """Rewrite the studies that are named, or all."""
    names = sys.argv[1:] or [path.parent.name for path in sorted(RESULTS.glob("*/curves.csv"))]
    for name in names:
        rewrite(RESULTS / name)
        print(RESULTS / name)


if __name__ == "__main__":
    main()
