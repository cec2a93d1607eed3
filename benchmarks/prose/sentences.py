"""Sentences whose numbers are computed: found in a page whatever its line breaks, and filled.

A sentence is a piece of a page, with the numbers that were computed between marks: "n = 11 takes
«1.7» times as long". The piece says where the numbers stand; a page is right where each stands so.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

SLOT = re.compile(r"«([^»]*)»")
NUMBER = re.compile(r"\d[\d,]*(?:\.\d+)?")
ONE = r"(?:[≤≥?]\s+)?[+−-]?\d+(?:,\d{3})*(?:\.\d+)*(?:\s+\[[+−-]?[\d.,]+,\s+[+−-]?[\d.,]+\])?"
VALUE = rf"({ONE}(?:\s+(?:to|/)\s+{ONE})*)"
"""A number, its interval, a span or several over a slash."""

NOT_PROSE = re.compile(r"^(```|~~~).*?^\1|\]\([^)]*\)|`[^`\n]*`|src=\S+", re.DOTALL | re.MULTILINE)


def pattern(sentence: str) -> re.Pattern[str]:
    r"""Return what finds a sentence in a page: any numbers in its slots, any white space.

    Examples
    --------
    >>> bool(pattern("takes «2.0» times as long").search("it takes 1.7 times as\nlong"))
    True
    """
    parts = []
    for k, part in enumerate(SLOT.split(sentence)):
        if k % 2:
            parts.append(VALUE)
        else:
            parts.append(r"\s+".join(map(re.escape, re.split(r"\s+", part))))
    return re.compile("".join(parts))


def places(text: str, sentence: str) -> Iterator[tuple[int, int, str]]:
    """Yield where each number of a sentence stands in a page, and what it should be.

    Raises
    ------
    ValueError
        If the page does not hold the sentence, or holds it twice.
    """
    found = list(pattern(sentence).finditer(text))
    if len(found) != 1:
        raise ValueError(f"a page holds {len(found)} times what it should hold once: {sentence}")
    for k, value in enumerate(SLOT.findall(sentence), start=1):
        yield *found[0].span(k), value


def filled(text: str, sentences: list[str]) -> str:
    r"""Return a page with the numbers that its sentences should have.

    Examples
    --------
    >>> filled("it takes 1.7 times as\nlong", ["takes «2.0» times as long"])
    'it takes 2.0 times as\nlong'
    """
    for sentence in sentences:
        for start, end, value in reversed(list(places(text, sentence))):
            if text[start:end].split() != value.split():  # a line break within is no other number
                text = text[:start] + value + text[end:]
    return text


def uncovered(text: str, sentences: list[str]) -> list[str]:
    """Return the lines of a page with numbers outside code that no sentence computes."""
    hidden = [(m.start(), m.end()) for m in NOT_PROSE.finditer(text)]
    for sentence in sentences:
        hidden += [(start, end) for start, end, _ in places(text, sentence)]
    shown = list(text)
    for start, end in hidden:
        for k in range(start, end):
            if shown[k] != "\n":
                shown[k] = " "
    return [
        f"{k}: {line.strip()}"
        for k, line in enumerate("".join(shown).split("\n"), start=1)
        if NUMBER.search(line)
    ]
