"""Checks of what parts tell their environment: theirs may be anybody's."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots import Robot
from clarke_gym.sensors import JointSensor, TaskSensor
from clarke_gym.tasks import Outcome

BEND_MARGIN = 1.0 + 1e-6
"""How far beyond the limit a start's bend may be, over it: by rounding."""


def check_rows(kind: str, name: str, told: Any, shape: tuple[int, ...]) -> None:
    """Refuse what is no array of a shape.

    Parameters
    ----------
    kind, name : str
        Which part told it, and what: words for the message, put together where there is one.
    told : object
    shape : tuple of int

    Raises
    ------
    ValueError

    Examples
    --------
    >>> check_rows("reading of sensor", "mine", np.zeros((2, 3)), (2, 3))
    """
    if getattr(told, "shape", None) != shape:
        found = f"the shape {told.shape}" if isinstance(told, np.ndarray) else repr(told)
        raise ValueError(f"{kind} {name!r} must be an array of the shape {shape}, got {found}")


def check_finite_rows(kind: str, name: str, told: Any, shape: tuple[int, ...]) -> None:
    """Refuse what is no array of a shape, or holds a number that is not finite.

    Parameters
    ----------
    kind, name : str
        Which part told it, and what.
    told : object
    shape : tuple of int

    Raises
    ------
    ValueError

    Examples
    --------
    >>> check_finite_rows("command of disturbance", "mine", np.zeros((2, 3)), (2, 3))
    """
    check_rows(kind, name, told, shape)
    finite = np.isfinite(told)
    if not finite.all():
        row = int(np.argmin(finite.reshape(len(told), -1).all(axis=1)))
        raise ValueError(
            f"{kind} {name!r} must hold finite numbers, got {told[row].tolist()} (row {row})"
        )


def check_outcome(task: str, outcome: Outcome, rows: int, metrics: Collection[str] = ()) -> None:
    """Refuse outcomes that have anything but a number for each robot, or lack a metric.

    Parameters
    ----------
    task : str
        Its name.
    outcome : Outcome
    rows : int
        Robots B.
    metrics : collection of str
        Names of those that the task declares.

    Raises
    ------
    ValueError
        With what it is.

    Examples
    --------
    >>> check_outcome("mine", Outcome(np.zeros(2), np.zeros(2, bool)), 2)
    """
    if not isinstance(outcome, Outcome):
        raise ValueError(f"task {task!r}: `evaluate` must return an Outcome, got {outcome!r}")
    lacking = [name for name in metrics if name not in outcome.metrics]
    if lacking:
        raise ValueError(
            f"task {task!r} declares the metrics {lacking}, which its outcome lacks; it has "
            f"{list(outcome.metrics)}"
        )
    told = {"reward": outcome.reward, "success": outcome.success}
    told |= {f"metric {name!r}": value for name, value in outcome.metrics.items()}
    told |= {f"term {name!r}": value for name, value in outcome.terms.items()}
    if outcome.failure is not None:
        told["failure"] = outcome.failure
    check_finite_rows("reward of the outcome of task", task, outcome.reward, (rows,))
    for name, value in told.items():
        check_rows(f"{name} of the outcome of task", task, value, (rows,))


def check_start(task: str, bending: FloatArray, robot: Robot) -> None:
    """Refuse starts that are no shapes of the robot.

    Parameters
    ----------
    task : str
    bending : ndarray, shape (R, S, 2)
        [rad].
    robot : Robot

    Raises
    ------
    ValueError

    Examples
    --------
    >>> check_start("mine", np.zeros((4, 1, 2)), Robot())
    """
    check_finite_rows("starts of task", task, bending, (len(bending), robot.n_segments, 2))
    beyond = np.hypot(bending[..., 0], bending[..., 1]) / robot.max_bending
    if beyond.max() > BEND_MARGIN:
        raise ValueError(
            f"starts of task {task!r} bend a segment {beyond.max():.3g} times as far as "
            "max_bending_rad lets it"
        )


def check_sensors(
    told: Iterable[tuple[JointSensor | TaskSensor, Any]], rows: int, tendons: int
) -> None:
    """Refuse readings that have anything but their numbers for each robot.

    Parameters
    ----------
    told : iterable of (sensor, reading)
    rows, tendons : int
        Robots B, and tendons of each.

    Raises
    ------
    ValueError

    Examples
    --------
    >>> check_sensors([], 1, 3)
    """
    for sensor, reading in told:
        size = tendons if isinstance(sensor, JointSensor) else len(sensor.labels)
        check_finite_rows("reading of sensor", sensor.name, reading, (rows, size))
