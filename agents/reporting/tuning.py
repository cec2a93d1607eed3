"""The trials of a tuning as a figure: how the scores of every arm are spread, and its winner."""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from agents.files import TRIALS, write_bytes
from agents.reporting.bootstrap import Array
from agents.reporting.house_style import FORMATS, INK, Panel, house_style, rendered
from agents.reporting.marks import marks_of
from agents.reporting.results import ResultsError

NAME = "tuning"
"""Name of the files of the figure."""


def read_trials(path: Path) -> dict[str, Array]:
    """Return the scores in a ``tuning.csv``.

    Parameters
    ----------
    path : Path

    Returns
    -------
    dict
        Name of an arm -> AUC of success, shape (configurations, seeds).

    Raises
    ------
    ResultsError
        If it cannot be read, or arms lack trials.
    """
    scores: dict[str, dict[str, list[float]]] = {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                of_arm = scores.setdefault(row["arm"], {})
                of_arm.setdefault(row["configuration"], []).append(float(row["auc"]))
        found = {arm: np.array(list(of_arm.values())) for arm, of_arm in scores.items()}
    except (OSError, KeyError, ValueError, TypeError, csv.Error) as error:
        raise ResultsError(f"{path}: cannot be read: {error}") from error
    if not found or any(array.ndim != 2 for array in found.values()):
        raise ResultsError(f"{path}: every arm needs the same trials")
    return found


def tuning_figure(trials: Mapping[str, Array], arms: Mapping[str, tuple[str, str]]) -> Figure:
    """Draw the trials of every arm: a dot for each configuration, a box of all, the winner.

    Parameters
    ----------
    trials : mapping
        As `read_trials` gives them.
    arms : mapping
        Name of an arm -> its task and representation.

    Returns
    -------
    Figure
    """
    marks = marks_of(list(dict.fromkeys(name for _, name in arms.values())))
    tasks = list(dict.fromkeys(task for task, _ in arms.values()))
    count, seeds = next(iter(trials.values())).shape
    footer = (
        f"{count} configurations, the same for every arm, on {seeds} seeds each; dot: mean of a "
        "configuration over its seeds; box: quartiles and median of them; large mark: the winner"
    )
    with house_style():
        rows = max(sum(task == other for other, _ in arms.values()) for task in tasks)
        panel = Panel(
            "AUC of success of all trials",
            footer,
            marks,
            columns=len(tasks),
            cell=(3.6, 0.8 + 0.55 * rows),
        )
        for ax, task in zip(panel.axes[0], tasks, strict=True):
            here = {arm: name for arm, (of_task, name) in arms.items() if of_task == task}
            for y, (arm, name) in enumerate(here.items()):
                mark, means = marks[name], trials[arm].mean(axis=1)
                ax.boxplot(
                    means,
                    positions=[y],
                    widths=0.5,
                    orientation="horizontal",
                    manage_ticks=False,
                    showfliers=False,
                    boxprops={"color": mark.colour},
                    whiskerprops={"color": mark.colour},
                    capprops={"color": mark.colour},
                    medianprops={"color": mark.colour, "lw": 2.2},
                )
                offset = 0.16 * (np.arange(count) % 3 - 1)  # close dots stand beside each other
                ax.plot(means, y + offset, ".", color=mark.colour, ms=6, alpha=0.55)
                best = means.max()
                ax.plot(best, y, marker=mark.marker, ms=9, color=mark.colour, mec=INK, mew=1.2)
                ax.annotate(
                    f"{best:.3f}",
                    (best, y),
                    (0, 9),
                    textcoords="offset points",
                    ha="center",
                    fontsize=7.5,
                )
            ax.set_title(task)
            ax.set_yticks(range(len(here)), list(here.values()))
            ax.set_ylim(rows - 0.4, -0.6)
            ax.set_xlim(-0.02, 1.02)
            ax.set_xlabel("AUC of success")
        return panel.figure


def write_tuning(
    folder: Path, arms: Mapping[str, tuple[str, str]], kinds: tuple[str, ...] = FORMATS
) -> None:
    """Write the figure beside the ``tuning.csv`` that it shows.

    Parameters
    ----------
    folder : Path
    arms : mapping
        Name of an arm -> its task and representation.
    kinds : tuple of str
        Of `FORMATS`.
    """
    figure = tuning_figure(read_trials(folder / TRIALS), arms)
    for kind in kinds:
        write_bytes(folder / f"{NAME}.{kind}", rendered(figure, kind))
