"""Labels in CSV files: no spreadsheet takes one for a formula, and each is read back as it was."""

from __future__ import annotations

_MARKED = ("=", "+", "-", "@", "\t", "\r", "'")


def to_cell(label: str) -> str:
    """Return a label as a cell; an apostrophe stands before what may be a formula.

    Examples
    --------
    >>> to_cell("raw"), to_cell("-0.5")
    ('raw', "'-0.5")
    """
    return f"'{label}" if label.startswith(_MARKED) else label


def from_cell(cell: str) -> str:
    """Return the label of a cell.

    Examples
    --------
    >>> from_cell(to_cell("=1+1")), from_cell(to_cell("'"))
    ('=1+1', "'")
    """
    return cell.removeprefix("'")
