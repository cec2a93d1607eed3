"""Pose: bring the tip to a goal position, pointing in a goal direction."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Goal, Metric, register_task
from clarke_gym.tasks.shaped import ShapedTask, error_metrics

Z_AXIS = np.array([0.0, 0.0, 1.0])

ANGLE_SCALE_RAD = math.radians(25.0)
"""Angle at which its closeness is one half."""

ANGLE_PER_TOLERANCE = math.radians(5.0) / 0.02
"""Tolerance of the direction [rad] over that of the position as a fraction of the length."""


@register_task("pose")
class Pose(ShapedTask):
    r"""Reach a goal position with the tip while it points in a goal direction.

    The errors are the distance e between tip and goal and the angle a between the tip's tangent and
    the goal's, which counts as the chord :math:`2\sin(a/2)`. Parallel tendons do not actuate twist,
    so the direction is a unit vector, not an orientation. The dense reward is
    :math:`\frac14/(1 + e/s) + \frac14/(1 + a/s_a) + \frac12\exp(-(e/\epsilon)^2-(a/\epsilon_a)^2)`.

    Every segment's bend is drawn so that its own tip is uniform over its dome; the goal is the tip
    of that shape and its tangent, so both can be had together. One segment has no choice: its
    direction follows from its position.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon of the position, as a fraction of the robot's length; None for the
        difficulty's: 0.04, 0.02 and 0.01 at difficulty 0, 0.5 and 1. The direction's follows:
        10, 5 and 2.5 degrees there.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard".
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.
    """

    sensors = ("command", "displacement", "tip_position", "tip_tangent")

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float | None = None,
        difficulty: float | str = 0.5,
        random_start: bool = True,
    ) -> None:
        super().__init__(robot, reward, success_tolerance, difficulty, random_start)
        self.numbers = 4 * robot.n_segments
        labels = ("x", "y", "z", "tangent x", "tangent y", "tangent z")
        self.goal = Goal(labels, "m, 1", (robot.length_m,) * 3 + (1.0,) * 3)
        angle = Metric("tip_angle_deg", "tip angle", "deg", 180.0)
        self.metrics = (*error_metrics(robot.length_m), angle)

    def tolerances(self) -> list[tuple[float, float]]:
        """Return scale and tolerance of the position [m] and the direction [rad]."""
        most = ANGLE_PER_TOLERANCE * self.success_tolerance
        return [*super().tolerances(), (ANGLE_SCALE_RAD, most)]

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2), and goal positions and tangents (R, 6)."""
        start, shape = self.shapes(numbers)
        return start, self.predicted(shape)

    def aimed(self, parameters: FloatArray, goal: FloatArray) -> FloatArray:
        """Return goals (R, 6) that somebody asks for, their directions as unit vectors."""
        position, direction = np.split(super().aimed(parameters, goal), [3], axis=-1)
        size = np.linalg.norm(direction, axis=-1, keepdims=True)
        if not size.all():
            raise ValueError(f"options['goal'] needs directions other than zero, got {goal}")
        return np.concatenate([position, direction / size], axis=-1)

    def predicted(self, bending: FloatArray) -> FloatArray:
        """Return the tip's positions [m] and tangents of shapes (..., S, 2) [rad]."""
        position, quaternion = kinematics.forward(bending, self.robot.lengths)
        return np.concatenate([position, kinematics.rotate(quaternion, Z_AXIS)], axis=-1)

    def achieved(self, state: RobotState) -> FloatArray:
        """Return the tip's position [m] and tangent."""
        return np.concatenate([state.tip_position, state.tip_tangent], axis=1)

    def squares(self, achieved: FloatArray, desired: FloatArray) -> list[FloatArray]:
        """Return the squares of the distance [m^2] and of the chord between the tangents."""
        gap = achieved - desired
        return [np.vecdot(part, part) for part in (gap[:, :3], gap[:, 3:])]

    def told(self, errors: list[FloatArray]) -> Mapping[str, FloatArray]:
        """Return the metrics of distance [m] and chord."""
        angle = np.degrees(2.0 * np.arcsin(np.minimum(0.5 * errors[1], 1.0)))
        return {**super().told(errors[:1]), "tip_angle_deg": angle}
