"""Figures of a report; each function returns it, or None if there is nothing to show."""

from collections.abc import Callable, Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agents.metrics import Metric
from agents.reporting.bootstrap import Array, Interval
from agents.reporting.house_style import (
    DASHED,
    FAINT,
    INK,
    Panel,
    house_style,
    log_axis,
    mark,
    steps_axis,
)
from agents.reporting.inside import LABELS, load_inside
from agents.reporting.results import Arm, Reference
from agents.reporting.statistics import curve_band, iqm, performance_profile
from agents.reporting.summary import ALL_TASKS, Comparison, Summary
from agents.reporting.survival import survival_curve
from agents.reporting.wording import metric_text

COLUMNS = 5  # tasks side by side before a new row begins


def _panel(summary: Summary, footer: str, title: str, per_task: int = 1) -> tuple[Panel, Iterator]:
    """Make axes for every task, `per_task` of them stacked, and an iterator of (task, stack)."""
    tasks = summary.study.tasks
    columns = min(len(tasks), COLUMNS)
    blocks = -(-len(tasks) // columns)
    names = summary.study.representations
    panel = Panel(title, footer, names, rows=per_task * blocks, columns=columns)
    stacks = []
    for i in range(blocks * columns):
        block, column = divmod(i, columns)
        stack = [panel.axes[per_task * block + k][column] for k in range(per_task)]
        if i < len(tasks):
            stack[0].set_title(tasks[i])
            stacks.append((tasks[i], stack))
        else:
            for ax in stack:
                ax.remove()
    return panel, iter(stacks)


def _curves(ax: Axes, summary: Summary, arm: Arm, curves: Array) -> None:
    """Draw the IQM over seeds with its band, and a thin line for each seed."""
    if not len(curves):
        return
    m, steps = mark(arm.representation), summary.study.env_steps
    ax.plot(steps, curves.T, color=m.colour, lw=0.5, alpha=0.35)
    centre, low, high = curve_band(curves, seed=summary.seed, reps=summary.reps)
    ax.fill_between(steps, low, high, color=m.colour, alpha=0.16, lw=0)
    ax.plot(steps, centre, color=m.colour, ls=m.line)


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
        panel, stacks = _panel(summary, footer, title, per_task=2)
        for task, (top, low) in stacks:
            top.axhline(study.threshold, color=FAINT, lw=0.8, ls=":")
            shown: list[float] = []
            metric = study.leading_of(task)
            for arm in study.of_task(task):
                _curves(top, summary, arm, study.success(arm))
                if metric and arm.metrics:
                    curves = study.curves(arm, metric)
                    _curves(low, summary, arm, curves)
                    shown.extend(iqm(curves, axis=0))
            _reference(top, low, study.references.get(task), metric, shown)
            if shown and min(shown) > 0 and max(shown) > 4 * min(shown):
                log_axis(low.yaxis)
            top.set_ylim(-0.03, 1.03)
            top.set_ylabel("success rate")
            low.set_ylabel(metric.with_unit() if metric else "")
            steps_axis(top)
            steps_axis(low)
        return panel.figure


def wall_clock(summary: Summary, footer: str) -> Figure | None:
    """Success rate over wall-clock time: median seconds over the seeds of an arm."""
    study = summary.study
    if not any(run.wall_s is not None for run in study.runs):
        return None
    with house_style():
        title = "Success rate over wall clock (IQM; median seconds over seeds)"
        panel, stacks = _panel(summary, footer, title)
        for task, (ax,) in stacks:
            for arm in study.of_task(task):
                timed = [(r.wall_s, e) for r, e in arm.done if r.wall_s is not None]
                if timed:
                    m = mark(arm.representation)
                    seconds = np.median([wall for wall, _ in timed], axis=0)
                    success = iqm([e.is_success.mean(axis=1) for _, e in timed], axis=0)
                    ax.plot(seconds, success, color=m.colour, ls=m.line)
            ax.set_ylim(-0.03, 1.03)
            ax.set_xlabel("wall clock [s]")
            ax.set_ylabel("success rate")
        return panel.figure


def _point(ax: Axes, y: float, interval: Interval, representation: str) -> None:
    """Draw an estimate with its interval, the estimate alone where there is none."""
    m = mark(representation)
    if interval.known:
        ax.plot([interval.low, interval.high], [y, y], color=m.colour, lw=2.2)
    ax.plot([interval.estimate], [y], color=m.colour, marker=m.marker, ms=6, mec="white", mew=0.6)


def auc_points(summary: Summary, footer: str) -> Figure:
    """AUC of success of every arm: IQM with interval over the dots of its seeds."""
    with house_style():
        rows = max(len(summary.study.of_task(task)) for task in summary.study.tasks)
        title = "Normalised AUC of the success rate: IQM, 95 % CI, dot per seed"
        panel, stacks = _panel(summary, footer, title)
        for task, (ax,) in stacks:
            names = []
            for y, arm in enumerate(s for s in summary.arms if s.arm.task == task):
                name = arm.arm.representation
                names.append(name)
                if arm.n:
                    dots = np.full(arm.n, y + 0.22)
                    ax.plot(arm.runs.auc, dots, ".", color=mark(name).colour, ms=5, alpha=0.5)
                    _point(ax, y, arm.auc, name)
            ax.set_yticks(range(len(names)), names)
            ax.set_ylim(rows - 0.4, -0.6)
            ax.set_xlim(-0.02, 1.02)
            ax.set_xlabel("AUC of success")
        return panel.figure


SHOWN_INSIDE = ("noise_on", "noise_off", "approx_kl", "clip_fraction")


def inside(summary: Summary, footer: str) -> Figure | None:
    """Noise on and off the manifold, KL and clipping over environment steps, task by task."""
    rows = load_inside(summary.study)
    if not rows:
        return None
    with house_style():
        title = "Inside the runs: means over seeds"
        panel, stacks = _panel(summary, footer, title, per_task=len(SHOWN_INSIDE))
        for task, axes in stacks:
            for ax, name in zip(axes, SHOWN_INSIDE, strict=True):
                for row in (row for row in rows if row.task == task and name in row.values):
                    m = mark(row.representation)
                    ax.plot(row.env_steps, row.values[name], color=m.colour, ls=m.line)
                ax.set_ylabel(LABELS[name])
                steps_axis(ax)
        return panel.figure


def _forest(ax: Axes, rows: list[Comparison], value: Callable[[Comparison], Interval]) -> None:
    for y, row in enumerate(rows):
        _point(ax, y, value(row), row.representation)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    edge = next((y for y, row in enumerate(rows) if row.task == ALL_TASKS), 0)
    if edge:
        ax.axhline(edge - 0.5, color=FAINT, lw=0.8)


def forest(summary: Summary, footer: str) -> Figure | None:
    """Difference in AUC and speed-up over the baseline, per task and averaged."""
    rows = [*summary.comparisons, *summary.pooled]
    if not rows:
        return None
    with house_style():
        panel = Panel(
            f"Against {summary.study.baseline}: estimate with 95 % CI, right of the line is better",
            footer,
            list(dict.fromkeys(row.representation for row in rows)),
            columns=2,
            cell=(4.2, 0.9 + 0.27 * len(rows)),
        )
        area, speed = panel.axes[0]
        _forest(area, rows, lambda row: row.auc_difference)
        _forest(speed, rows, lambda row: row.speed_up)
        names = [f"{row.task} · {row.representation}" for row in rows]
        area.set_yticks(range(len(rows)), names)
        speed.set_yticks(range(len(rows)), [""] * len(rows))
        ends = [v for r in rows for v in (r.speed_up.estimate, r.speed_up.low, r.speed_up.high)]
        reach = max([np.log(2), *(abs(np.log(v)) for v in ends if 0 < v < np.inf)])
        log_axis(speed.xaxis)
        speed.set_xlim(np.exp(-1.08 * reach), np.exp(1.08 * reach))
        speed.set_xlabel("speed-up (restricted mean steps)")
        area.set_xlabel("difference in AUC of success (primary)")
        speed.axvline(1, color=INK, lw=0.8)
        area.axvline(0, color=INK, lw=0.8)
        return panel.figure


def survival(summary: Summary, footer: str) -> Figure:
    """Kaplan-Meier curves of the steps to the success threshold, as the share of runs there."""
    study = summary.study
    with house_style():
        title = (
            f"Share of runs that reached {100 * study.threshold:.3g} % success (1 − Kaplan–Meier)"
        )
        panel, stacks = _panel(summary, footer, title)
        for task, (ax,) in stacks:
            for arm in (s for s in summary.arms if s.arm.task == task and s.n):
                m = mark(arm.arm.representation)
                times, rest = survival_curve(arm.runs.steps, arm.runs.reached)
                times, rest = np.append(times, study.env_steps[-1]), np.append(rest, rest[-1])
                # the baseline lies broad below the others: equal steps would hide it
                width = 3.6 if arm.arm.representation == study.baseline else 1.6
                ax.step(times, 1 - rest, where="post", color=m.colour, ls=m.line, lw=width)
                if arm.reached < arm.n:
                    ax.plot(times[-1], 1 - rest[-1], marker="|", ms=11, color=m.colour, mew=2)
            ax.set_ylim(-0.03, 1.03)
            ax.set_ylabel("share of runs")
            steps_axis(ax, "environment steps (bar: runs censored)")
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
        panel, stacks = _panel(summary, footer, title)
        for task, (ax,) in stacks:
            ax.set_ylim(-0.03, 1.03)
            metric = study.leading_of(task)
            if metric is None:
                continue
            found = [(arm, study.final(arm, metric)) for arm in study.of_task(task)]
            seen = np.concatenate([values.ravel() for _, values in found])
            levels, logarithmic = _levels(seen)
            sign = 1.0 if metric.factor * metric.worst >= np.median(seen) else -1.0
            for arm, values in found:
                m = mark(arm.representation)
                lost = np.full((arm.count("failed"), values.shape[1]), np.inf)
                scores = np.concatenate([sign * values, lost])
                if not len(scores):
                    continue
                runs = performance_profile(scores, sign * levels)
                mid, low, high = curve_band(runs, seed=summary.seed, reps=summary.reps, mean=True)
                ax.fill_between(levels, low, high, color=m.colour, alpha=0.16, lw=0)
                ax.plot(levels, mid, color=m.colour, ls=m.line)
            if logarithmic:
                log_axis(ax.xaxis)
            ax.set_xlabel(f"{metric.label} τ" + (f" [{metric.shown_unit}]" if metric.unit else ""))
            ax.set_ylabel(f"share of goals {'≤' if sign > 0 else '≥'} τ")
        return panel.figure
