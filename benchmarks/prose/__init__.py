"""Numbers in the prose of README and docs, computed from committed result files.

python -m benchmarks.prose

lists the lines of these pages that hold a number outside code that nothing computes: settings,
versions, names. `benchmarks.pages` writes the computed ones into the pages again.
"""

from __future__ import annotations

from collections.abc import Callable

from agents.files import ROOT
from benchmarks.prose import learning, machine, physics
from benchmarks.prose.sentences import filled, uncovered

PAGES: dict[str, Callable[[], list[str]]] = {
    "README.md": learning.readme,
    "docs/results.md": learning.results,
    "docs/comparison.md": learning.comparison,
    "docs/validation/README.md": physics.validation,
    "docs/robots_and_physics.md": physics.robots,
    "docs/speed.md": machine.speed,
    "docs/study.md": machine.study,
    "docs/reliability.md": machine.reliability,
    "docs/use_with.md": machine.use_with,
    "docs/explorer.md": machine.explorer,
}
"""Pages whose prose has measured numbers, and the sentences that hold them."""


def page(name: str) -> str:
    """Return a page as its result files have it.

    Raises
    ------
    ValueError
        If a sentence is not in the page.
    """
    return filled((ROOT / name).read_text(encoding="utf-8"), PAGES[name]())


def rest(name: str) -> list[str]:
    """Return the lines of a page with numbers that nothing computes."""
    return uncovered((ROOT / name).read_text(encoding="utf-8"), PAGES[name]())
