"""Colour, line and marker of every arm: any two in one panel are apart for everybody.

Apart means CIEDE2000 >= 12 as people see, and as protanopes and deuteranopes do (tested), on a
light page and on a dark one. Line and marker differ as well, so nothing rests on colour alone.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any


@dataclass(frozen=True)
class Mark:
    """How one arm is drawn; `dark` is its colour on a dark page."""

    colour: str
    line: Any
    marker: Any
    dark: str


DASHED, DOTTED, DASHDOT, LONG = (0, (5, 2)), (0, (1, 1.3)), (0, (5, 2, 1, 2)), (0, (9, 3))
MARKS = {
    "raw": Mark("#D55E00", "-", "s", "#EE6611"),
    "raw_scaled": Mark("#8C2819", LONG, "d", "#AA5522"),
    "clarke": Mark("#0072B2", "-", "o", "#33AAFF"),
    "projected": Mark("#E69F00", DASHED, "D", "#FFBB22"),
    "rotated": Mark("#56B4E9", DASHED, "^", "#99DDFF"),
    "two_tendon": Mark("#009E73", DASHDOT, "v", "#00AA88"),
    "random_basis": Mark("#CC79A7", DASHDOT, "P", "#BB77AA"),
    "arc_polar": Mark("#882255", DOTTED, "X", "#DD5566"),
    "clarke_common": Mark("#2A01C4", DOTTED, "p", "#8844FF"),
    "antagonistic": Mark("#39201F", LONG, "h", "#FFDDCC"),
    "scaled marginal": Mark("#74D2AF", DASHDOT, ">", "#77CC88"),
    "repaired": Mark("#74D2AF", DASHDOT, ">", "#77CC88"),
}
"""Marks of arms that many studies have: theirs in every figure."""

SPARES = (
    Mark("#876978", DASHDOT, (5, 0, 180), "#DDAABB"),
    Mark("#0F0F1E", DOTTED, "H", "#886677"),
    Mark("#4B87FF", DASHED, "<", "#DDFFFF"),
    Mark("#000F69", LONG, "8", "#995599"),
)
PALETTE = tuple(dict.fromkeys((*SPARES, *MARKS.values())))
"""What an arm of any other name may get: spare marks first, then those of absent arms."""

MOST = 7
"""Arms in one panel; more are divided into small multiples."""


def panels_of(names: Sequence[str]) -> list[list[str]]:
    """Divide the arms of a study into panels.

    Parameters
    ----------
    names : sequence of str
        Arms, the baseline first: it stands in every panel.

    Returns
    -------
    list of list of str
        One panel where that is enough; otherwise panels of about the same number of arms.

    Examples
    --------
    >>> panels_of(["raw", "clarke"])
    [['raw', 'clarke']]
    >>> panels_of(list("abcdefghi"))
    [['a', 'b', 'c', 'd', 'e'], ['a', 'f', 'g', 'h', 'i']]
    """
    if len(names) <= MOST:
        return [list(names)]
    first, others = names[0], names[1:]
    count = -(-len(others) // (MOST - 1))
    ends = [round(i * len(others) / count) for i in range(count + 1)]
    return [[first, *others[i:j]] for i, j in pairwise(ends)]


def marks_of(names: Sequence[str]) -> dict[str, Mark]:
    """Return the mark of every arm of a study; it follows from the list alone.

    Parameters
    ----------
    names : sequence of str
        Arms, the baseline first.

    Returns
    -------
    dict
        Name -> mark, in the order of the names. No two arms of a panel (`panels_of`) share one,
        and no two of the study do as far as the palette reaches.

    Examples
    --------
    >>> found = marks_of(["raw", "mine", "clarke"])
    >>> found["raw"] == MARKS["raw"], found["mine"] == SPARES[0]
    (True, True)
    """
    found: dict[str, Mark] = {}
    for name in names:  # where two names stand for one arm, the second gets another mark
        if name in MARKS and MARKS[name] not in found.values():
            found[name] = MARKS[name]
    used = Counter(found.values())
    for panel in panels_of(names):
        for name in panel:
            if name not in found:
                taken = {found[other] for other in panel if other in found}
                free = [mark for mark in PALETTE if mark not in taken]
                found[name] = min(free, key=lambda mark: used[mark])
                used[found[name]] += 1
    return {name: found[name] for name in names}
