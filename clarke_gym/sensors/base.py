"""What a sensor is: a block of an observation with a name, labels, a unit and bounds."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, constant
from clarke_gym.numerics.registry import Registry
from clarke_gym.physics.base import Physics, RobotState
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.robots.robot import Robot
from clarke_gym.tasks.base import Task

BOUND_MARGIN = 1.0 + 1e-5
"""Room for float32 rounding between a value and the bound of its space."""


@dataclass(frozen=True)
class Plant:
    """What a sensor is made for.

    Parameters
    ----------
    robot : Robot
    physics : Physics
    task : Task
    disturbances : sequence of Disturbance
    """

    robot: Robot
    physics: Physics
    task: Task
    disturbances: Sequence[Any] = ()

    @property
    def margin(self) -> float:
        """Largest scaled magnitude of what commands bound, with room for rounding."""
        return BOUND_MARGIN * self.physics.displacement_bound


class Sensor:
    """A block of an observation. Sensors see plain arrays with a row for each robot, in SI units.

    Parameters
    ----------
    plant : Plant
    """

    name: str = ""
    unit: ClassVar[str] = ""
    needs: ClassVar[tuple[str, ...]] = ()
    """Nouns of `RobotState` that not every physics has, e.g. "tension"."""

    measured: ClassVar[bool] = True
    """Whether noise and its like act on it; commands and what a task tells are not measured."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Return whether a plant has what this sensor tells, for "oracle": all that there is."""
        return all(noun in plant.physics.OFFERS for noun in cls.needs)


class JointSensor(Sensor, ABC):
    """A number for each tendon; what policies see of it is written in their representation."""

    @property
    def scale(self) -> FloatArray:
        """What each segment's numbers are divided by, shape (S,)."""
        return self.plant.robot.max_clarke

    @property
    def bound(self) -> tuple[float, FloatArray]:
        """Largest magnitude of scaled Clarke coordinates, and of off-manifold numbers (N,)."""
        factor, robot = self.plant.margin, self.plant.robot
        return factor, factor * robot.max_cocontraction_m / robot.joint_scale

    @property
    def passes(self) -> bool:
        """Whether numbers can pass the bounds for a moment, and are clipped there."""
        return True

    @abstractmethod
    def read(self, state: RobotState) -> FloatArray:
        """Return a number for each tendon, shape (B, N), in SI units."""

    def vector(self, state: RobotState, splitter: Splitter) -> JointVector:
        """Return the same, split by the projector."""
        return splitter.rows(self.read(state))


class TaskSensor(Sensor, ABC):
    """Numbers that are the same in every representation."""

    @property
    @abstractmethod
    def labels(self) -> tuple[str, ...]:
        """A name for each number."""

    @property
    @abstractmethod
    def scale(self) -> float | FloatArray:
        """What the numbers are divided by: all, or each, shape (size,)."""

    @property
    def bound(self) -> float:
        """Largest magnitude of a scaled number."""
        return self.plant.margin

    @abstractmethod
    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the numbers, shape (B, size), in SI units; `goal` is (B, goal size)."""

    @cached_property
    def _factor(self) -> FloatArray:
        return constant(1.0 / self.scale)

    def observed(self, state: RobotState, goal: FloatArray) -> NDArray[np.floating[Any]]:
        """Return the numbers as policies see them."""
        return self.read(state, goal) * self._factor


SENSORS: Registry[Any] = Registry("sensor")
"""Sensors by name."""

ORACLE = "oracle"
"""Name for all sensors that there are, and what disturbances hide."""

LADDER = {
    "tendons": ("displacement", "velocity"),
    "tip": ("tip_position", "tip_tangent", "tip_velocity"),
    "contact": ("clearance", "contact_force"),
}
"""Names for several sensors together."""

SENSORS.reserve([*LADDER, ORACLE, "none"])


def register_sensor(name: str) -> Callable[[Any], Any]:
    """Return a decorator that makes a sensor available in ``sensors="... + name"``.

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
        If the name is taken, or what is decorated is no `JointSensor` or `TaskSensor`.

    Examples
    --------
    >>> @register_sensor("tip_height_doctest")
    ... class TipHeight(TaskSensor):
    ...     unit = "m"
    ...     labels = ("z",)
    ...     scale = property(lambda self: self.plant.robot.length_m)
    ...     def read(self, state, goal):
    ...         return state.tip_position[:, 2:]
    """
    return SENSORS.decorator(name, Sensor)
