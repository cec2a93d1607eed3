"""What is known of the shape, the goal and the surroundings."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.sensors.base import BOUND_MARGIN, Plant, TaskSensor, register_sensor
from clarke_gym.tasks.base import Goal, GoalTask

MOST_SPEED = 4.0
"""Largest speed that is seen, over what tendons at their speed limit do to a straight robot."""

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


@register_sensor("tip_velocity")
class TipVelocity(_Position):
    """Velocity of the tip."""

    unit: ClassVar[str] = "m/s"
    needs: ClassVar[tuple[str, ...]] = ("tip_velocity",)

    @property
    def scale(self) -> float:
        """Faster than tendons at their speed limit turn a straight robot's tip round its base."""
        robot = self.plant.robot
        return float((robot.tendon_speeds / robot.pitch_radii).max() * robot.length_m)

    @property
    def bound(self) -> float:
        """Some times that: shapes swing."""
        return MOST_SPEED * BOUND_MARGIN

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return velocities [m/s]."""
        del goal
        most = self.bound * self.scale
        return np.minimum(np.maximum(state.tip_velocity, -most), most)


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

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where there are bodies."""
        return super().fits(plant) and bool(plant.task.scene.bodies)

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

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where there are bodies."""
        return super().fits(plant) and bool(plant.task.scene.bodies)

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
    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where there is a goal."""
        return plant.task.goal is not None

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        if plant.task.goal is None:
            raise ValueError(f"sensor {self.name!r} needs a task with a goal")
        self._goal: Goal = plant.task.goal
        self.unit = self._goal.unit  # type: ignore[misc]

    @property
    def labels(self) -> tuple[str, ...]:
        """Those of the goal, without costs."""
        return self._goal.labels[self._goal.shown]

    @property
    def scale(self) -> float | FloatArray:
        """That of the goal."""
        return self._goal.observed_scale

    @property
    def bound(self) -> float:
        """That of the goal."""
        return self._goal.bound * self.plant.margin


@register_sensor("goal")
class GoalSensor(_OfGoal):
    """What is to be reached."""

    measured: ClassVar[bool] = False

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the goals."""
        del state
        return goal[:, self._goal.shown]


@register_sensor("preview")
class Preview(_OfGoal):
    """Where a moving goal will be."""

    measured: ClassVar[bool] = False

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where goals move and may be foreseen."""
        return super().fits(plant) and plant.task.previews > 0

    @property
    def labels(self) -> tuple[str, ...]:
        """Those of the goal, for each control period ahead."""
        ahead, labels = range(1, self.plant.task.previews + 1), super().labels
        return tuple(f"{label} in {k}" for k in ahead for label in labels)

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        if not plant.task.previews:
            raise ValueError("sensor 'preview' needs a task whose goal moves and may be foreseen")

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the goals to come, one after the other."""
        del goal
        ahead = range(1, self.plant.task.previews + 1)
        goals = [state.goal_after(k)[:, self._goal.shown] for k in ahead]
        return np.concatenate(goals, axis=1)

    @property
    def scale(self) -> float | FloatArray:
        """That of the goal, repeated."""
        scale = super().scale
        return scale if np.ndim(scale) == 0 else np.tile(scale, self.plant.task.previews)


@register_sensor("obstacles")
class Obstacles(_Position):
    """Where the bodies of a scene are that every episode places anew."""

    measured: ClassVar[bool] = False

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where bodies are placed."""
        return plant.task.scene.placed

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        scene = plant.task.scene
        if not scene.placed:
            raise ValueError("sensor 'obstacles' needs a task whose bodies every episode places")
        places: list[int] = []
        labels: list[str] = []
        for k, body in enumerate(scene.bodies):
            ends = ("",) if body.is_sphere else (" start", " end")
            for j, end in enumerate(ends):
                places += [7 * k + 3 * j + i for i in range(3)]
                labels += [f"{axis} of body {k}{end}" for axis in "xyz"]
            if scene.resized:
                places.append(7 * k + 6)
                labels.append(f"radius of body {k}")
        self._places, self._labels = np.array(places), tuple(labels)

    @property
    def labels(self) -> tuple[str, ...]:
        """Coordinates of each sphere's middle, and of each rod's ends."""
        return self._labels

    @property
    def bound(self) -> float:
        """Twice the length: bodies may lie out of reach."""
        return 2.0 * BOUND_MARGIN

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the coordinates [m]."""
        del goal
        numbers = state.bodies
        return numbers.reshape(len(numbers), -1).take(self._places, axis=1)


@register_sensor("goal_gap")
class GoalGap(_OfGoal):
    """From what is achieved to the goal."""

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where a task compares the two."""
        return super().fits(plant) and isinstance(plant.task, GoalTask)

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
        return (goal - self._seen(state)[1])[:, self._goal.shown]

    def observed(self, state: RobotState, goal: FloatArray) -> NDArray[np.floating[Any]]:
        """Return the difference of what policies see, to the bit."""
        gap = self._goal.observed(goal) - self._seen(state)[0]
        return gap[:, self._goal.shown]


@register_sensor("hidden")
class Hidden(TaskSensor):
    """What disturbances have drawn for the episode, which a robot does not know."""

    measured: ClassVar[bool] = False
    unit: ClassVar[str] = "1"
    scale = 1.0

    @classmethod
    def fits(cls, plant: Plant) -> bool:
        """Where something is hidden."""
        return any(disturbance.hidden for disturbance in plant.disturbances)

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        if not self.fits(plant):
            raise ValueError("sensor 'hidden' needs disturbances that draw something")

    @property
    def labels(self) -> tuple[str, ...]:
        """The disturbances, with a number where one has drawn several."""
        return tuple(
            f"{disturbance.name} {k}" if disturbance.hidden > 1 else disturbance.name
            for disturbance in self.plant.disturbances
            for k in range(disturbance.hidden)
        )

    @property
    def bound(self) -> float:
        """1: numbers are from -1 to 1."""
        return 1.0

    def read(self, state: RobotState, goal: FloatArray) -> FloatArray:
        """Return the numbers, from -1 to 1."""
        del state, goal
        drawn = [d.drawn[:, : d.hidden] for d in self.plant.disturbances]
        return 2.0 * np.hstack(drawn) - 1.0
