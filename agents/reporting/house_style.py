"""House style of every figure: fonts, layout, axes, labels and the reporting footer."""

import io
import textwrap
from collections.abc import Mapping
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import EngFormatter

from agents.reporting.marks import Mark

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
LABEL_ROW = 0.068  # height of a label at a line's end, of the axes
LONGEST = 26  # characters of such a label


def _keys(marks: Mapping[str, Mark]) -> list[Line2D]:
    return [
        Line2D([], [], color=m.colour, ls=m.line, marker=m.marker, ms=4) for m in marks.values()
    ]


class Panel:
    """A grid of axes under a title and a legend, above the reporting footer.

    Without `marks` there is no legend: then axes have their own (`legend_below`).
    """

    def __init__(
        self,
        title: str,
        footer: str,
        marks: Mapping[str, Mark],
        *,
        rows: int = 1,
        columns: int = 1,
        cell: tuple[float, float] = (3.6, 2.7),
    ) -> None:
        width = max(columns * cell[0], 6.4)
        notes = textwrap.wrap(footer, int(width * 21))
        per_row = max(1, int(width / (0.75 + 0.075 * max(map(len, marks), default=1))))
        legend_rows = -(-len(marks) // per_row)
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
        if marks:
            self.figure.legend(
                _keys(marks),
                list(marks),
                loc="upper left",
                bbox_to_anchor=(0.0, 1 - (TITLE_IN - 0.02) / height),
                ncols=per_row,
                frameon=False,
                handlelength=2.6,
            ).set_in_layout(False)
        self.axes: list[list[Axes]] = self.figure.subplots(rows, columns, squeeze=False).tolist()


def legend_below(ax: Axes, marks: Mapping[str, Mark]) -> None:
    """Put a legend of its own under the axes of a small multiple."""
    ax.legend(
        _keys(marks),
        list(marks),
        loc="upper left",
        bbox_to_anchor=(-0.12, -0.24),
        frameon=False,
        fontsize=7.5,
        handlelength=2.6,
    )


def label_ends(ax: Axes, ends: Mapping[str, tuple[float, float, Mark]]) -> None:
    """Write names right of the axes, at the height of their lines' ends, none over another.

    Parameters
    ----------
    ax : Axes
        With its limits and scales as they will be.
    ends : mapping
        Name -> last x and y of its line, and its mark.
    """
    ax.get_ylim()  # settles limits that follow from data
    within = ax.transData + ax.transAxes.inverted()
    places = {name: tuple(within.transform((x, y))) for name, (x, y, _) in ends.items()}
    order = sorted(ends, key=lambda name: places[name][1])
    heights = np.clip([places[name][1] for name in order], 0.0, 1.0)
    room = LABEL_ROW * np.arange(len(order))  # labels below the k-th, at least
    heights = np.maximum.accumulate(heights - room) + room
    heights = np.minimum(heights, 1.0 - room[::-1])
    for name, height in zip(order, heights, strict=True):
        colour = ends[name][2].colour
        ax.annotate(
            name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…",
            places[name],
            (1.06, height),
            xycoords="axes fraction",
            textcoords="axes fraction",
            va="center",
            fontsize=7,
            color=INK,
            arrowprops={
                "arrowstyle": "-",
                "color": colour,
                "lw": 0.8,
                "relpos": (0.0, 0.5),
                "shrinkA": 0,
                "shrinkB": 0,
            },
            annotation_clip=False,
        )


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
