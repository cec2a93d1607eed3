"""What all parts of the validation share: result rows, the reference data, figures."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference"


class Skipped(Exception):
    """A part cannot run here, and why."""


@dataclass(frozen=True)
class Row:
    """One measured number and the conditions that it holds under."""

    part: str
    case: str
    conditions: str
    value: float
    unit: str
    bar: float | None = None

    @property
    def verdict(self) -> str:
        """Whether the value is within its bar."""
        if self.bar is None:
            return ""
        return "met" if self.value <= self.bar else "missed"


def reference(*parts: str) -> Path:
    """Return a path of the reference data, or raise `Skipped` where it is absent."""
    path = REFERENCE.joinpath(*parts)
    if not path.exists():
        raise Skipped(f"no reference data at {path}")
    return path


def save(figure: Figure, out: Path, name: str) -> None:
    """Write a figure as PNG."""
    figure.tight_layout()
    figure.savefig(out / f"{name}.png", dpi=120)


def markdown(rows: list[Row]) -> str:
    """Return rows as a table in Markdown."""
    lines = [
        "| part | case | conditions | value | bar | |",
        "| --- | --- | --- | ---: | ---: | --- |",
    ]
    for row in rows:
        bar = "" if row.bar is None else f"{row.bar:g}"
        lines.append(
            f"| {row.part} | {row.case} | {row.conditions} | {row.value:.4g} {row.unit} "
            f"| {bar} | {row.verdict} |"
        )
    return "\n".join(lines) + "\n"


def read(path: Path) -> list[Row]:
    """Return the rows of an earlier table, none where there is none."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return [
            Row(
                r["part"],
                r["case"],
                r["conditions"],
                float(r["value"]),
                r["unit"],
                float(r["bar"]) if r["bar"] else None,
            )
            for r in csv.DictReader(file)
        ]
