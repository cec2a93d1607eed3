"""Which held-out goals fail at the end, over the workspace: a panel for every task and arm."""

import numpy as np
from matplotlib.figure import Figure

from agents.reporting.bootstrap import Array
from agents.reporting.house_style import FAINT, Panel, house_style
from agents.reporting.results import Arm
from agents.reporting.summary import Summary

COLUMNS = 4
COLOURS = "viridis_r"  # grows darker with the share, also for those who see fewer colours


def failing(arm: Arm) -> tuple[Array, Array] | None:
    """Return the held-out goals of an arm, and the share of its runs that fail each at the end.

    Parameters
    ----------
    arm : Arm

    Returns
    -------
    goals : ndarray, shape (G, 3)
        Positions [m].
    share : ndarray, shape (G,)
        Over finished and failed runs; a failed run fails everywhere. None instead of both where no
        run tells its goals, or the runs had different ones.
    """
    done = [evals for _, evals in arm.done]
    goals = [evals.goals for evals in done if evals.goals is not None]
    if not goals or len(goals) < len(done) or any(not np.array_equal(goals[0], g) for g in goals):
        return None
    failures = sum((~evals.is_success[-1] for evals in done), np.zeros(len(goals[0])))
    lost = arm.count("failed")
    return goals[0], (failures + lost) / (len(done) + lost)


def failure_map(summary: Summary, footer: str) -> Figure | None:
    """Share of seeds that fail each held-out goal; the workspace is seen from above."""
    study = summary.study
    arms = [arm for task in study.tasks for arm in study.of_task(task)]
    found = [(arm, of_arm) for arm in arms if (of_arm := failing(arm)) is not None]
    if not found:
        return None
    columns = min(COLUMNS, len(found), *([len(study.representations)] * (len(study.tasks) > 1)))
    with house_style():
        title = "Failure map: share of seeds that fail a held-out goal at the end"
        panel = Panel(
            title, footer, {}, rows=-(-len(found) // columns), columns=columns, cell=(2.5, 2.5)
        )
        axes = [ax for row in panel.axes for ax in row]
        reach = 1050 * max(np.abs(goals[:, :2]).max() for _, (goals, _) in found)
        for ax, (arm, (goals, share)) in zip(axes, found, strict=False):
            order = np.argsort(share, kind="stable")  # what fails most lies on top
            points = ax.scatter(
                1000 * goals[order, 0],
                1000 * goals[order, 1],
                c=share[order],
                s=8 + 40 * share[order],
                cmap=COLOURS,
                vmin=0.0,
                vmax=1.0,
                edgecolors=FAINT,
                linewidths=0.3,
            )
            ax.set_title(f"{arm.task} · {arm.representation}", fontsize=8)
            ax.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
            ax.set(xlabel="x [mm]", ylabel="y [mm]")
        for ax in axes[len(found) :]:
            ax.remove()
        bar = panel.figure.colorbar(points, ax=axes[: len(found)], shrink=0.8, aspect=30)
        bar.set_label("share of seeds that fail")
        return panel.figure
