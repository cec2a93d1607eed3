"""Every page that follows from code and committed result files, written again by one command.

python -m benchmarks.pages

What measured scripts write themselves (docs/validation, docs/results/measured) is their result.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from agents.files import ROOT, write_text
from benchmarks import (
    leaderboard,
    limits,
    planning,
    policy_cards,
    prose,
    sensor_tables,
    task_pages,
    task_soak,
    why_clarke,
)
from benchmarks.committed_scores import DOCS
from benchmarks.measured import measured
from benchmarks.validation.common import markdown, read


def pages() -> Iterator[tuple[Path, str]]:
    """Yield every such page, and what it should hold."""
    for module in (leaderboard, planning):
        yield module.PAGE, module.page(json.loads(module.DATA.read_text(encoding="utf-8")))
    for module in (limits, sensor_tables, why_clarke):
        yield module.PAGE, module.page()
    yield task_soak.PAGE, task_soak.page(measured(task_soak.DATA)["pieces"])
    for name, text in task_pages.pages().items():
        yield task_pages.FOLDER / name, text
    for path in sorted(policy_cards.POLICIES.glob("*/scores.json")):
        scores = json.loads(path.read_text(encoding="utf-8"))
        yield path.parent / "README.md", policy_cards.card(path.parent, scores)
    yield policy_cards.POLICIES / "README.md", policy_cards.index()
    table = DOCS / "validation" / "results.csv"
    yield table.with_suffix(".md"), markdown(read(table))
    for name in prose.PAGES:
        yield ROOT / name, prose.page(name)


def main() -> None:
    """Write the pages that differ."""
    for path, text in pages():
        if path.read_text(encoding="utf-8") != text:
            write_text(path, text)
            print(path.relative_to(ROOT))


if __name__ == "__main__":
    main()
