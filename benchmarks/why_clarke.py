"""docs/why_clarke.md and its figures, from the committed results of the studies it speaks of.

python -m benchmarks.why_clarke

Every number of the page is computed here; a test fails where page and results differ.
"""

from __future__ import annotations

from pathlib import Path

from agents.files import write_text
from benchmarks.committed_scores import DOCS
from benchmarks.mechanism import mechanism_words
from benchmarks.other_studies import other_words
from benchmarks.robustness import robust_words
from benchmarks.scaling_law import scaling_words
from benchmarks.why_clarke_figures import write_figures

PAGE, TEMPLATE = DOCS / "why_clarke.md", Path(__file__).with_name("why_clarke.template.md")


def page() -> str:
    """Return the page: the template with every {name} replaced.

    Raises
    ------
    KeyError
        If the template names something that is not computed.
    """
    words = mechanism_words() | scaling_words() | other_words() | robust_words()
    return TEMPLATE.read_text(encoding="utf-8").format_map(words)


def main() -> None:
    """Write the page and its figures."""
    write_text(PAGE, page())
    write_figures(DOCS / "why")
    print(PAGE)


if __name__ == "__main__":
    main()
