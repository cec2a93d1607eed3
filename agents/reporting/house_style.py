"""House style of every figure: colours, marks, layout and the reporting footer."""

import io
import textwrap
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter

RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.8,
    "savefig.dpi": 144,
    "figure.facecolor": "white",
    "svg.hashsalt": "clarke_gym",
    "svg.fonttype": "none",  # letters stay letters
    "pdf.fonttype": 42,
    "text.parse_math": False,  # names from a study file are shown as they are
}
INK, FAINT = "#222222", "#666666"
TITLE_IN, LEGEND_ROW_IN, FOOTER_ROW_IN = 0.34, 0.24, 0.14  # heights of the bands, inches


@dataclass(frozen=True)
class Mark:
    """How one representation is drawn, always the same."""

    colour: str
    line: Any
    marker: str


DASHED, DOTTED, DASHDOT, LONG = (0, (5, 2)), (0, (1, 1.3)), (0, (5, 2, 1, 2)), (0, (9, 3))
# Any two are apart by CIEDE2000 >= 12 for protanopes and deuteranopes, too (tested); line and
# marker differ as well, so nothing rests on colour alone.
MARKS = {
    "raw": Mark("#D55E00", "-", "s"),
    "raw_scaled": Mark("#8C2819", LONG, "d"),
    "clarke": Mark("#0072B2", "-", "o"),
    "projected": Mark("#E69F00", DASHED, "D"),
    "rotated": Mark("#56B4E9", DASHED, "^"),
    "two_tendon": Mark("#009E73", DASHDOT, "v"),
    "random_basis": Mark("#CC79A7", DASHDOT, "P"),
    "arc_polar": Mark("#882255", DOTTED, "X"),
    "clarke_common": Mark("#2A01C4", DOTTED, "p"),
    "antagonistic": Mark("#39201F", LONG, "h"),
    "scaled marginal": Mark("#74D2AF", DASHDOT, ">"),
    "repaired": Mark("#74D2AF", DASHDOT, ">"),
}
SPARE_COLOURS = ("#117733", "#AA4499", "#44AA99", "#661100", "#888888", "#000000")
SPARE_LINES = (DASHED, DASHDOT, DOTTED, LONG)
SPARE_MARKERS = ("<", ">", "*", "d", "8")


def mark(representation: str) -> Mark:
    """Return the mark of a representation; an unknown name gets one derived from its letters.

    Examples
    --------
    >>> mark("clarke").colour, mark("new") == mark("new")
    ('#0072B2', True)
    """
    if representation in MARKS:
        return MARKS[representation]
    code = zlib.crc32(representation.encode())  # hash() differs from one process to the next
    return Mark(
        SPARE_COLOURS[code % len(SPARE_COLOURS)],
        SPARE_LINES[code // 8 % len(SPARE_LINES)],
        SPARE_MARKERS[code // 64 % len(SPARE_MARKERS)],
    )


class Panel:
    """A grid of axes under a title and a legend, above the reporting footer."""

    def __init__(
        self,
        title: str,
        footer: str,
        representations: Sequence[str],
        *,
        rows: int = 1,
        columns: int = 1,
        cell: tuple[float, float] = (3.6, 2.7),
    ) -> None:
        width = max(columns * cell[0], 6.4)
        notes = textwrap.wrap(footer, int(width * 21))
        per_row = max(1, int(width / (0.75 + 0.075 * max(map(len, representations), default=1))))
        legend_rows = -(-len(representations) // per_row)
        top = TITLE_IN + LEGEND_ROW_IN * legend_rows
        bottom = FOOTER_ROW_IN * (len(notes) + 1)
        height = rows * cell[1] + top + bottom
        self.figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(self.figure)
        engine: Any = self.figure.get_layout_engine()
        engine.set(rect=(0, bottom / height, 1, 1 - (top + bottom) / height))
        edge = 0.1 / width
        self.figure.text(
            edge, 1 - 0.1 / height, title, va="top", fontsize=11, weight="bold", color=INK
        )
        self.figure.text(
            edge, 0.07 / height, "\n".join(notes), va="bottom", fontsize=6.5, color=FAINT
        )
        marks = [mark(name) for name in representations]
        self.figure.legend(
            [Line2D([], [], color=m.colour, ls=m.line, marker=m.marker, ms=4) for m in marks],
            representations,
            loc="upper left",
            bbox_to_anchor=(0.0, 1 - (TITLE_IN - 0.02) / height),
            ncols=per_row,
            frameon=False,
            handlelength=2.6,
        ).set_in_layout(False)
        self.axes: list[list[Axes]] = self.figure.subplots(rows, columns, squeeze=False).tolist()


FORMATS = ("png", "svg", "pdf")
"""Formats of every figure: for pages, for the web at any size, for papers."""

_UNDATED: dict[str, dict[str, Any]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}


def rendered(figure: Figure, kind: str) -> bytes:
    """Return a figure as a file; the same figure always gives the same bytes.

    Parameters
    ----------
    figure : Figure
    kind : str
        One of `FORMATS`.
    """
    buffer = io.BytesIO()
    with house_style():
        figure.savefig(buffer, format=kind, metadata=_UNDATED.get(kind))
    return buffer.getvalue()


def steps_axis(ax: Axes, name: str = "environment steps") -> None:
    """Label an axis of environment steps, with k and M for thousands and millions."""
    ax.xaxis.set_major_formatter(EngFormatter(sep=""))
    ax.set_xlabel(name)


def log_axis(axis: Axis) -> None:
    """Make an axis logarithmic with plain numbers, also at 2 and 5 between the decades."""

    def between(value: float, _: float) -> str:
        digit = round(value / 10 ** np.floor(np.log10(value)))
        return f"{value:g}" if digit in (2, 5) else ""

    if isinstance(axis, XAxis):
        axis.axes.set_xscale("log")
    else:
        axis.axes.set_yscale("log")
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(between)


def house_style() -> Any:
    """Return a context in which figures must be made and rendered."""
    return mpl.rc_context(RC)
