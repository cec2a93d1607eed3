"""What is known of the shape, the goal and the surroundings."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.sensors.base import BOUND_MARGIN, Plant, TaskSensor, register_sensor
from clarke_gym.tasks.base import Goal, GoalTask

BACKBONE_POINTS = 4
"""Points a segment that the sensor "backbone" sees."""


class _Position(TaskSensor):
    unit: ClassVar[str] = "m"

    @property
    def labels(self) -> tuple[str, ...]:
        """Axes of the base frame."""
        return ("x", "y", "z")

    @property
    def scale(self) -> float:
        """The robot's length [m]."""
        return self.plant.robot.length_m


@register_sensor("tip_position")
class TipPosition(_Position):
    """Position of the tip."""

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return tip positions [m]."""
        del goal
        return state.tip_position


@register_sensor("tip_tangent")
class TipTangent(_Position):
    """The tip's unit z axis."""

    unit: ClassVar[str] = "1"

    @property
    def scale(self) -> float:
        """1: it has unit length."""
        return 1.0

    @property
    def bound(self) -> float:
        """1, but for rounding."""
        return BOUND_MARGIN

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return tangents."""
        del goal
        return state.tip_tangent


@register_sensor("backbone")
class Backbone(_Position):
    """Points along the backbone, without the base."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Axes of each point."""
        count = BACKBONE_POINTS * self.plant.robot.n_segments
        return tuple(f"{axis}{k}" for k in range(1, count + 1) for axis in "xyz")

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the points [m], one after the other."""
        del goal
        points = state.backbone(BACKBONE_POINTS)[:, 1:]
        return points.reshape(len(points), -1)


@register_sensor("clearance")
class Clearance(TaskSensor):
    """Smallest gap between robot and scene; without bodies it is at its bound."""

    unit: ClassVar[str] = "m"

    @property
    def labels(self) -> tuple[str, ...]:
        """One number."""
        return ("gap",)

    @property
    def scale(self) -> float:
        """The robot's length [m]."""
        return self.plant.robot.length_m

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return gaps [m], at most the robot's length."""
        del goal
        return np.minimum(state.clearance, self.scale)[:, None]


@register_sensor("contact_force")
class ContactForce(TaskSensor):
    """Magnitude of the net force between robot and scene."""

    unit: ClassVar[str] = "N"
    needs: ClassVar[tuple[str, ...]] = ("contact_force",)

    @property
    def labels(self) -> tuple[str, ...]:
        """One number."""
        return ("force",)

    @property
    def scale(self) -> float:
        """10 N: what is more is not seen."""
        return 10.0

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return forces [N]."""
        del goal
        return np.minimum(state.contact_force, self.scale)[:, None]


class _OfGoal(TaskSensor):
    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        if plant.task.goal is None:
            raise ValueError(f"sensor {self.name!r} needs a task with a goal")
        self._goal: Goal = plant.task.goal
        self.unit = self._goal.unit  # type: ignore[misc]

    @property
    def labels(self) -> tuple[str, ...]:
        """Those of the goal."""
        return self._goal.labels

    @property
    def scale(self) -> float | FloatArray:
        """That of the goal."""
        scale: float | FloatArray = self._goal.divisor
        return scale

    @property
    def bound(self) -> float:
        """That of the goal."""
        return self._goal.bound * self.plant.margin


@register_sensor("goal")
class GoalSensor(_OfGoal):
    """What is to be reached."""

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the goals."""
        del state
        return goal


@register_sensor("goal_gap")
class GoalGap(_OfGoal):
    """From what is achieved to the goal."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        if not isinstance(plant.task, GoalTask):
            raise ValueError("sensor 'goal_gap' needs a task that compares its goal (GoalTask)")
        self._seen = plant.task.seen

    @property
    def bound(self) -> float:
        """Twice that of the goal."""
        return 2.0 * super().bound

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the gaps."""
        return goal - self._seen(state)[1]

    def observed(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the difference of what policies see, to the bit."""
        achieved = self._seen(state)[0]
        return np.subtract(self._goal.observed(goal), achieved, dtype=np.float64)
