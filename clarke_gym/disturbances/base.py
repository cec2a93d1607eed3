"""What a disturbance is: something that the nominal robot does not have, at make, reset or step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.registry import Registry
from clarke_gym.robots.robot import Robot


class Disturbance:
    """What reality does to a nominal robot; every hook does nothing unless it is overridden.

    Parameters
    ----------
    robot : Robot
        The nominal one, which limits, tasks and policies know.
    num_envs : int
        Batch size B.

    Notes
    -----
    Each environment draws `numbers` uniform numbers an episode for each disturbance, from a
    generator of its own seed beside the task's: goals do not depend on what disturbs.
    """

    name: ClassVar[str] = ""
    physics: ClassVar[tuple[str, ...]] = ("constant_curvature", "mujoco")
    """Models that it has a meaning in."""
    numbers: ClassVar[int] = 0
    """Uniform random numbers an episode."""

    def __init__(self, robot: Robot, num_envs: int) -> None:
        self.robot, self.num_envs = robot, num_envs

    def make(self, robot: Robot) -> Robot:
        """Return the robot that physics simulates, alike for all environments."""
        return robot

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin episodes in R environments; `numbers` is (R, numbers), `command` (R, N) [m]."""

    def step(self, command: FloatArray) -> FloatArray:
        """Return what reaches the tendons [m] of what the drives are told, both (B, N)."""
        return command

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on."""
        return {}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`."""


DISTURBANCES: Registry[Any] = Registry("disturbance")
"""Disturbances by name."""


def register_disturbance(name: str) -> Callable[[Any], Any]:
    """Return a decorator that makes a disturbance available in ``disturbances="... + name"``.

    Parameters
    ----------
    name : str
        A word of letters, digits and "_".

    Returns
    -------
    callable

    Raises
    ------
    ValueError, TypeError
        If the name is taken, or what is decorated is no `Disturbance`.

    Examples
    --------
    >>> @register_disturbance("weak_doctest")
    ... class Weak(Disturbance):
    ...     def step(self, command):
    ...         return 0.9 * command
    """
    return DISTURBANCES.decorator(name, Disturbance)
