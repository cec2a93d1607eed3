"""What a disturbance is: something that the nominal robot does not have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    strength : float
        What amplitudes are multiplied by; 1 is harsh.

    Notes
    -----
    Each environment draws `numbers` uniform numbers an episode for each disturbance, from a
    generator of its own seed beside the task's: goals do not depend on what disturbs. They are kept
    in `drawn`, and are part of `state()`.
    """

    name: ClassVar[str] = ""
    physics: ClassVar[tuple[str, ...]] = ("constant_curvature", "mujoco")
    """Models that it has a meaning in. What has one in constant curvature changes commands, sensors
    and where tendons run alone, and has one in models that users register, too."""
    numbers: ClassVar[int] = 0
    """Uniform random numbers an episode."""
    twins: ClassVar[Mapping[str, type[Disturbance]]] = {}
    """Who stands for it in physics that simulate what it does, by their names."""
    strongest: ClassVar[float] = 10.0
    """Largest strength that leaves a robot that there can be."""
    hidden: ClassVar[int] = 0
    """How many of them, the first ones, tell what disturbs: the sensor "hidden" shows them."""

    steps: NDArray[np.int64]
    """Control periods since the episodes began, (B,): the environment's own clock, to read."""

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        self.robot, self.num_envs, self.strength = robot, num_envs, strength
        self.drawn = np.zeros((num_envs, self.numbers))
        self.steps = np.zeros(num_envs, np.int64)

    def make(self, robot: Robot) -> Robot:
        """Return the robot that physics simulates, alike for all environments."""
        return robot

    def begin(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin episodes: keep what was drawn, and let `reset` follow."""
        self.drawn[rows] = numbers
        self.reset(rows, numbers, command)

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin episodes in R environments; `numbers` is (R, numbers), `command` (R, N) [m]."""

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return physical numbers of R robots by the names that `Physics.vary` takes."""
        del numbers
        return {}

    def step(self, command: FloatArray) -> FloatArray:
        """Return what reaches the tendons [m] of what the drives are told, both (B, N)."""
        return command

    def force(self) -> FloatArray:
        """Return forces on the tips in the base frame [N], (B, 3), during the next step."""
        return np.zeros((self.num_envs, 3))

    def sense(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return what a sensor tells of its true values, both (B, k) in SI units.

        It may be asked more than once a step, and must answer alike. `scale` is what policies see
        the values divided by: one number, or k.
        """
        del name, scale
        return values

    def get_state(self) -> dict[str, Any]:
        """Return a copy of what the future depends on beside `drawn`."""
        return {}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`."""

    @classmethod
    def fits(cls, physics: str) -> bool:
        """Return whether it has a meaning in a model."""
        alike = "constant_curvature" if physics != "mujoco" else physics
        return physics in cls.physics or alike in cls.physics

    def overrides(self, hook: str) -> bool:
        """Return whether a hook does something."""
        return getattr(type(self), hook) is not getattr(Disturbance, hook)


class Simulated(Disturbance):
    """Physical numbers of a robot that MuJoCo alone has, drawn for every episode."""

    physics: ClassVar[tuple[str, ...]] = ("mujoco",)
    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1


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
