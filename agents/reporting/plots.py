"""Figures of a report; each function returns it, or None if there is nothing to show."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agents.metrics import Metric
from agents.reporting.bands import Band
from agents.reporting.bootstrap import Array, Interval
from agents.reporting.house_style import (
    FAINT,
    INK,
    Panel,
    house_style,
    label_ends,
    log_axis,
    steps_axis,
)
from agents.reporting.inside import LABELS, load_inside
from agents.reporting.marks import DASHED, Mark, marks_of, panels_of
from agents.reporting.multiples import Cell, draw_line, label_room, small_multiples
from agents.reporting.results import Reference
from agents.reporting.statistics import curve_band, iqm, performance_profile
from agents.reporting.summary import ALL_TASKS, Comparison, Summary
from agents.reporting.survival import survival_curve
from agents.reporting.wording import metric_text


def _curves(ax: Axes, summary: Summary, cell: Cell, drawn: list[Band]) -> None:
    """Draw the IQM over seeds with its band, and a thin line for each seed."""
    steps = summary.study.env_steps
    for band in drawn:
        colour = cell.marks[band.representation].colour
        ax.plot(steps, band.curves.T, color=colour, lw=0.5, alpha=0.3)
        ax.fill_between(steps, band.low, band.high, color=colour, alpha=0.16, lw=0)
        draw_line(ax, cell, band.representation, steps, band.centre)


def _reference(
    top: Axes, low: Axes, reference: Reference | None, metric: Metric | None, shown: list[float]
) -> None:
    """Draw what classical control reaches; a value far below the curves is said, not drawn."""
    if reference is None:
        return
    top.axhline(reference.success_rate, color=INK, lw=0.9, ls=DASHED)
    if metric is None or metric.name not in reference.metrics:
        return
    value = metric.factor * reference.metrics[metric.name]
    drawn = bool(shown) and value >= min(shown) / 3.0
    if drawn:
        low.axhline(value, color=INK, lw=0.9, ls=DASHED)
        shown.append(value)
    text = f"classical control: {value:.2g} {metric.shown_unit}, below"
    text = "classical control" if drawn else text
    place = (1.0, value) if drawn else (1.0, 0.02)
    coordinates = ("axes fraction", "data") if drawn else "axes fraction"
    low.annotate(text, place, xycoords=coordinates, ha="right", va="bottom", fontsize=7, color=INK)


def learning_curves(summary: Summary, footer: str) -> Figure:
    """Success rate and the leading metric over environment steps."""
    study = summary.study
    with house_style():
        title = "Learning curves: IQM over seeds, 95 % band, thin line per seed"
        panel, cells = small_multiples(summary, footer, title, 2, label_room(summary))
        for cell in cells:
            top, low = cell.axes
            top.axhline(study.threshold, color=FAINT, lw=0.8, ls=":")
            metric = study.leading_of(cell.task)
            own = [b for b in summary.bands if cell.holds(b)]
            rates = [b for b in own if b.metric is None]
            errors = [b for b in own if b.metric is not None]
            _curves(top, summary, cell, rates)
            _curves(low, summary, cell, errors)
            shown = [value for band in errors for value in band.centre]
            _reference(top, low, study.references.get(cell.task), metric, shown)
            if shown and min(shown) > 0 and max(shown) > 4 * min(shown):
                log_axis(low.yaxis)
            top.set_ylim(-0.03, 1.03)
            top.set_ylabel("success rate")
            low.set_ylabel(metric.with_unit() if metric else "")
            for ax, drawn in ((top, rates), (low, errors)):
                steps_axis(ax)
                label_ends(
                    ax,
                    {
                        b.representation: (
                            study.env_steps[-1],
                            b.centre[-1],
                            cell.marks[b.representation],
                        )
                        for b in drawn
                    },
                )
        return panel.figure


def wall_clock(summary: Summary, footer: str) -> Figure | None:
    """Success rate over wall-clock time: median seconds over the seeds of an arm."""
    study = summary.study
    if not any(run.wall_s is not None for run in study.runs):
        return None
    with house_style():
        title = "Success rate over wall clock (IQM; median seconds over seeds)"
        panel, cells = small_multiples(summary, footer, title)
        for cell in cells:
            (ax,) = cell.axes
            for arm in filter(cell.holds, study.of_task(cell.task)):
                timed = [(r.wall_s, e) for r, e in arm.done if r.wall_s is not None]
                if timed:
                    seconds = np.median([wall for wall, _ in timed], axis=0)
                    success = iqm([e.is_success.mean(axis=1) for _, e in timed], axis=0)
                    draw_line(ax, cell, arm.representation, seconds, success)
            ax.set_ylim(-0.03, 1.03)
            ax.set_xlabel("wall clock [s]")
            ax.set_ylabel("success rate")
        return panel.figure


def _point(ax: Axes, y: float, interval: Interval, m: Mark) -> None:
    """Draw an estimate with its interval, the estimate alone where there is none."""
    if interval.known:
        ax.plot([interval.low, interval.high], [y, y], color=m.colour, lw=2.2)
    ax.plot([interval.estimate], [y], color=m.colour, marker=m.marker, ms=6, mec="white", mew=0.6)


def auc_points(summary: Summary, footer: str) -> Figure:
    """AUC of success of every arm: IQM with interval over the dots of its seeds."""
    with house_style():
        title = "Normalised AUC of the success rate: IQM, 95 % CI, dot per seed"
        panel, cells = small_multiples(summary, footer, title)
        for cell in cells:
            (ax,) = cell.axes
            arms = [arm for arm in summary.arms if cell.holds(arm.arm)]
            for y, arm in enumerate(arms):
                if arm.n:
                    m = cell.marks[arm.arm.representation]
                    ax.plot(
                        arm.runs.auc, np.full(arm.n, y + 0.22), ".", color=m.colour, ms=5, alpha=0.5
                    )
                    _point(ax, y, arm.auc, m)
            ax.set_yticks(range(len(arms)), [arm.arm.representation for arm in arms])
            ax.set_ylim(max(len(other.marks) for other in cells) - 0.4, -0.6)
            ax.set_xlim(-0.02, 1.02)
            ax.set_xlabel("AUC of success")
        return panel.figure


SHOWN_INSIDE = (
    "noise_on",
    "noise_off",
    "command_off",
    "capped",
    "slack",
    "approx_kl",
    "clip_fraction",
    "ent_coef",
    "critic_loss",
)
"""What is drawn of the inside of runs, as far as it is known."""


def inside(summary: Summary, footer: str) -> Figure | None:
    """Noise, KL, clipping and the like over environment steps, task by task."""
    rows = load_inside(summary.study)
    shown = [name for name in SHOWN_INSIDE if any(name in row.values for row in rows)]
    if not shown:
        return None
    with house_style():
        title = "Inside the runs: means over seeds"
        panel, cells = small_multiples(summary, footer, title, len(shown), label_room(summary))
        for cell in cells:
            for ax, name in zip(cell.axes, shown, strict=True):
                ends = {}
                for row in (row for row in rows if cell.holds(row) and name in row.values):
                    arm, values = row.representation, row.values[name]
                    draw_line(ax, cell, arm, row.env_steps, values)
                    ends[arm] = (row.env_steps[-1], values[-1], cell.marks[arm])
                label_ends(ax, ends)
                ax.set_ylabel(LABELS[name])
                steps_axis(ax)
        return panel.figure


def _forest(
    ax: Axes,
    rows: list[Comparison],
    marks: dict[str, Mark],
    value: Callable[[Comparison], Interval],
) -> None:
    for y, row in enumerate(rows):
        _point(ax, y, value(row), marks[row.representation])
    ax.set_ylim(len(rows) - 0.4, -0.6)
    edge = next((y for y, row in enumerate(rows) if row.task == ALL_TASKS), 0)
    if edge:
        ax.axhline(edge - 0.5, color=FAINT, lw=0.8)


def forest(summary: Summary, footer: str) -> Figure | None:
    """Difference in AUC and speed-up over the baseline, per task and averaged."""
    rows = [*summary.comparisons, *summary.pooled]
    if not rows:
        return None
    marks = marks_of(summary.study.representations)
    groups = [
        [row for row in rows if row.representation in names]
        for names in panels_of(summary.study.representations)
    ]
    groups = [group for group in groups if group]
    legend = (
        {} if len(groups) > 1 else {row.representation: marks[row.representation] for row in rows}
    )
    with house_style():
        panel = Panel(
            f"Against {summary.study.baseline}: estimate with 95 % CI, right of the line is better",
            footer,
            legend,
            rows=len(groups),
            columns=2,
            cell=(4.2, 0.9 + 0.27 * max(map(len, groups))),
        )
        ends = [v for r in rows for v in (r.speed_up.estimate, r.speed_up.low, r.speed_up.high)]
        reach = max([np.log(2), *(abs(np.log(v)) for v in ends if 0 < v < np.inf)])
        for group, (area, speed) in zip(groups, panel.axes, strict=True):
            _forest(area, group, marks, lambda row: row.auc_difference)
            _forest(speed, group, marks, lambda row: row.speed_up)
            names = [f"{row.task} · {row.representation}" for row in group]
            area.set_yticks(range(len(group)), names)
            speed.set_yticks(range(len(group)), [""] * len(group))
            log_axis(speed.xaxis)
            speed.set_xlim(np.exp(-1.08 * reach), np.exp(1.08 * reach))
            speed.axvline(1, color=INK, lw=0.8)
            area.axvline(0, color=INK, lw=0.8)
        limits = np.array([area.get_xlim() for area, _ in panel.axes])
        for area, _ in panel.axes:
            area.set_xlim(limits[:, 0].min(), limits[:, 1].max())
        speed.set_xlabel("speed-up (restricted mean steps)")
        area.set_xlabel("difference in AUC of success (primary)")
        return panel.figure


def survival(summary: Summary, footer: str) -> Figure:
    """Kaplan-Meier curves of the steps to the success threshold, as the share of runs there."""
    study = summary.study
    with house_style():
        title = (
            f"Share of runs that reached {100 * study.threshold:.3g} % success (1 − Kaplan–Meier)"
        )
        panel, cells = small_multiples(summary, footer, title, extra=label_room(summary))
        for cell in cells:
            (ax,) = cell.axes
            ends = {}
            for arm in (s for s in summary.arms if cell.holds(s.arm) and s.n):
                name = arm.arm.representation
                m = cell.marks[name]
                times, rest = survival_curve(arm.runs.steps, arm.runs.reached)
                times, rest = np.append(times, study.env_steps[-1]), np.append(rest, rest[-1])
                # the baseline lies broad below the others: equal steps would hide it
                width = 3.6 if name == study.baseline else 1.6
                ax.step(times, 1 - rest, where="post", color=m.colour, ls=m.line, lw=width)
                ends[name] = (times[-1], 1 - rest[-1], m)
                if arm.reached < arm.n:
                    ax.plot(times[-1], 1 - rest[-1], marker="|", ms=11, color=m.colour, mew=2)
            ax.set_ylim(-0.03, 1.03)
            ax.set_ylabel("share of runs")
            steps_axis(ax, "environment steps (bar: runs censored)")
            label_ends(ax, ends)
        return panel.figure


def _levels(values: Array) -> tuple[Array, bool]:
    """Levels of a profile over all finite values, and whether they are spaced logarithmically."""
    low, high = values.min(), values.max()
    if low < 0:
        return np.linspace(low, high, 80), False
    positive = values[values > 0]
    low = positive.min() if positive.size else 1.0
    return np.geomspace(low, max(high, 1.1 * low), 80), True


def profiles(summary: Summary, footer: str) -> Figure | None:
    """Draw performance profiles of the final leading metric over the goals of every run.

    A metric gets worse towards the worst value that its task declares, be it high or low; a failed
    run never reaches any level.
    """
    study = summary.study
    if not study.per_goal:
        return None
    with house_style():
        title = f"Performance profile of the final {metric_text(study)}: mean over seeds, 95 % band"
        panel, cells = small_multiples(summary, footer, title)
        for cell in cells:
            (ax,) = cell.axes
            ax.set_ylim(-0.03, 1.03)
            metric = study.leading_of(cell.task)
            if metric is None:
                continue
            found = [(arm, study.final(arm, metric)) for arm in study.of_task(cell.task)]
            seen = np.concatenate([values.ravel() for _, values in found])
            levels, logarithmic = _levels(seen)
            sign = -1.0 if metric.rises(seen) else 1.0
            for arm, values in (pair for pair in found if cell.holds(pair[0])):
                name = arm.representation
                lost = np.full((arm.count("failed"), values.shape[1]), np.inf)
                scores = np.concatenate([sign * values, lost])
                if not len(scores):
                    continue
                runs = performance_profile(scores, sign * levels)
                mid, low, high = curve_band(runs, seed=summary.seed, reps=summary.reps, mean=True)
                colour = cell.marks[name].colour
                ax.fill_between(levels, low, high, color=colour, alpha=0.16, lw=0)
                draw_line(ax, cell, name, levels, mid)
            if logarithmic:
                log_axis(ax.xaxis)
            ax.set_xlabel(f"{metric.label} τ" + (f" [{metric.shown_unit}]" if metric.unit else ""))
            ax.set_ylabel(f"share of goals {'≤' if sign > 0 else '≥'} τ")
        return panel.figure
