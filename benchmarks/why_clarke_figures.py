"""The three figures of docs/why_clarke.md, each as SVG and PNG."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from agents.files import write_bytes
from agents.reporting.house_style import (
    FAINT,
    INK,
    house_style,
    log_axis,
    rendered,
    steps_axis,
)
from agents.reporting.inside import TABLE, read_inside
from agents.reporting.marks import MARKS
from agents.reporting.statistics import iqm
from benchmarks import scaling_law
from benchmarks.committed_scores import DOCS, seeds
from benchmarks.mechanism import PATH, effect, mechanism

BAR, REST = MARKS["clarke"].colour, FAINT


def _figure(width: float, height: float, columns: int = 1) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(1, columns, squeeze=False)
    return figure, list(axes[0])


def waterfall() -> Figure:
    """AUC of success from raw to Clarke, one change a bar, with the interval of the change."""
    arms = mechanism()
    figure, (ax,) = _figure(7.6, 3.6)
    names = ["raw", *(what for _, what in PATH), "clarke"]
    level = float(iqm(arms["raw"].auc))
    start = level
    ax.barh(0, level, color=MARKS["raw"].colour, height=0.6)
    before = "raw"
    for y, (arm, _) in enumerate(PATH, 1):
        change = effect(arm, before)
        colour = BAR if y < len(PATH) else REST
        ax.barh(y, change.estimate, left=level, color=colour, height=0.6)
        ax.plot([level + change.low, level + change.high], [y, y], color=INK, lw=1.2)
        level += change.estimate
        ax.plot([level, level], [y - 0.3, y + 1.3], color=FAINT, lw=0.7)
        ax.annotate(
            f"{change.estimate:+.3f}", (1.01, y), xycoords=("axes fraction", "data"), va="center"
        )
        before = arm
    ax.barh(len(names) - 1, level, color=MARKS["clarke"].colour, height=0.6)
    for y, value in ((0, start), (len(names) - 1, level)):
        ax.annotate(f"{value:.3f}", (1.01, y), xycoords=("axes fraction", "data"), va="center")
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    low = min(start, level)
    ax.set_xlim(low - 0.04, max(level, start) + 0.05)
    note = f"n = 11, {seeds(arms.values())} seeds an arm, lines: 95 % interval of the change"
    ax.set_xlabel(f"AUC of success ({note})")
    ax.set_title("What the gap is made of, one change after the other", loc="left")
    return figure


SHOWN = ("raw", "raw_scaled", "scaled marginal", "clarke")
QUANTITIES = (
    ("noise_on", "noise on the manifold"),
    ("approx_kl", "approximate KL"),
    ("clip_fraction", "ratios clipped"),
)


def inside() -> Figure:
    """Noise on the manifold, KL and clipping over environment steps."""
    rows = {
        row.representation: row
        for row in read_inside(DOCS / "results" / "mechanism" / TABLE)
        if row.representation in SHOWN
    }
    figure, axes = _figure(8.4, 2.9, len(QUANTITIES))
    for ax, (name, label) in zip(axes, QUANTITIES, strict=True):
        for arm in SHOWN:
            m = MARKS[arm]
            ax.plot(
                rows[arm].env_steps,
                rows[arm].values[name],
                color=m.colour,
                ls=m.line,
                marker=m.marker,
                markevery=8,
                ms=4,
                label=arm,
            )
        ax.set_title(label)
        steps_axis(ax)
    keys = axes[0].get_legend_handles_labels()
    figure.legend(*keys, loc="outside upper left", ncols=len(SHOWN), frameon=False, fontsize=8)
    return figure


def law() -> Figure:
    """Ratio of steps to 90 % to those of Clarke coordinates over n, with the fitted laws."""
    figure, (ax,) = _figure(6.4, 3.6)
    grid = np.geomspace(2, 64, 60)
    fits = {entry.name: entry for entry in scaling_law.laws()}
    for name, line, function in (
        ("power", "-", scaling_law.power),
        ("linear", ":", scaling_law.linear),
    ):
        values = function(grid, fits[name].parameter.estimate)
        ax.plot(grid, values, color=FAINT, ls=line, lw=1.2, label=f"{name} law")
    for arm, place in (("raw", "raw"), ("repaired", "scaled marginal")):
        m = MARKS[place]
        for n, ratio in scaling_law.ratios(arm).items():
            held = arm == "raw" and n == scaling_law.HELD_OUT
            face = "white" if held else m.colour
            ax.plot([n, n], [ratio.low, ratio.high], color=m.colour, lw=1.5)
            ax.plot(n, ratio.estimate, marker=m.marker, color=m.colour, mfc=face, ms=7, ls="")
        ax.plot([], [], color=m.colour, marker=m.marker, ls="", label=arm)
    ax.axhline(1.0, color=INK, lw=0.8)
    log_axis(ax.xaxis)
    log_axis(ax.yaxis)
    ax.set_xlabel("number of tendons n (open: not used for the fit)")
    ax.set_ylabel("steps to 90 % / Clarke's")
    ax.legend(frameon=False)
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {"waterfall": waterfall, "inside": inside, "law": law}
"""Name of the files -> what draws them."""


def write_figures(folder: Path) -> None:
    """Write every figure as SVG and PNG into a folder."""
    folder.mkdir(exist_ok=True)
    with house_style():
        for name, draw in FIGURES.items():
            figure = draw()
            for kind in ("svg", "png"):
                write_bytes(folder / f"{name}.{kind}", rendered(figure, kind))
