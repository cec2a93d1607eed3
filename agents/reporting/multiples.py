"""Small multiples: a panel for every task, more where its arms are too many for one."""

from dataclasses import dataclass

from matplotlib.axes import Axes
from numpy.typing import ArrayLike

from agents.reporting.bands import Band
from agents.reporting.house_style import LONGEST, Panel, legend_below
from agents.reporting.inside import Inside
from agents.reporting.marks import Mark, marks_of, panels_of
from agents.reporting.results import Arm, Study
from agents.reporting.summary import Summary


def _columns(panels: int) -> int:
    """Return how many panels stand side by side, three at most, in rows of about one length."""
    return 2 if panels == 4 else min(panels, 3)


@dataclass(frozen=True)
class Cell:
    """One task, and as many of its arms as one panel holds, on axes above each other."""

    task: str
    marks: dict[str, Mark]
    axes: list[Axes]

    def holds(self, arm: Arm | Band | Inside) -> bool:
        """Whether an arm, or what is known of it, is drawn here."""
        return arm.task == self.task and arm.representation in self.marks


def parts(study: Study) -> list[tuple[str, str, list[str]]]:
    """Divide a study into panels.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of (task, heading, names of arms)
        Panels that would show no arm of their task, or the baseline alone, are left out.
    """
    found = []
    for task in study.tasks:
        present = {arm.representation for arm in study.of_task(task)}
        groups = panels_of(study.representations)
        groups = [names for names in groups if present & set(names[1:])] or groups[:1]
        for i, names in enumerate(groups):
            part = f" ({i + 1} of {len(groups)})" if len(groups) > 1 else ""
            found.append((task, task + part, names))
    return found


def small_multiples(
    summary: Summary, footer: str, title: str, per_task: int = 1, extra: float = 0.0
) -> tuple[Panel, list[Cell]]:
    """Make `per_task` axes for every task and panel of arms, `extra` inches wider than usual."""
    study, marks = summary.study, marks_of(summary.study.representations)
    cells, tasks = parts(study), len(study.tasks)
    several = len(panels_of(study.representations)) > 1
    side_by_side = len(cells) // tasks  # panels of a task
    columns = _columns(side_by_side if side_by_side > 1 else len(cells))
    blocks = -(-len(cells) // columns)
    most = max(len(names) for _, _, names in cells)
    panel = Panel(
        title,
        footer,
        {} if several else marks,
        rows=per_task * blocks,
        columns=columns,
        cell=(3.6 + extra, 2.7 + (0.17 * most / per_task if several else 0.0)),
    )
    made = []
    for i in range(blocks * columns):
        block, column = divmod(i, columns)
        stack = [panel.axes[per_task * block + k][column] for k in range(per_task)]
        if i >= len(cells):
            for ax in stack:
                ax.remove()
            continue
        task, heading, names = cells[i]
        own = {name: marks[name] for name in names}
        stack[0].set_title(heading)
        if several:
            legend_below(stack[-1], own)
        made.append(Cell(task, own, stack))
    return panel, made


def draw_line(ax: Axes, cell: Cell, name: str, x: ArrayLike, y: ArrayLike) -> None:
    """Draw the line of an arm with its markers, which stand apart from those of other arms."""
    mark, at = cell.marks[name], list(cell.marks).index(name)
    ax.plot(
        x,
        y,
        color=mark.colour,
        ls=mark.line,
        marker=mark.marker,
        ms=4,
        mec="white",
        mew=0.5,
        markevery=(0.2 * at / len(cell.marks), 0.2),  # fractions of the panel
    )


def label_room(summary: Summary) -> float:
    """Return the inches that names need beside the axes."""
    longest = max(map(len, summary.study.representations))
    return 0.2 + 0.055 * min(longest, LONGEST)
