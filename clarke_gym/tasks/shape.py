"""Shape: bring the whole backbone to a goal shape."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Goal, register_task
from clarke_gym.tasks.shaped import ShapedTask, error_metrics

POINTS = 2
"""Points a segment that a shape is compared at."""


@register_task("shape")
class Shape(ShapedTask):
    r"""Bring the backbone to a goal shape, told by points along it.

    The error e is the root mean square of the distances between K points of the backbone and of the
    goal, two a segment; its scale s is a tenth of the length. The dense reward is
    :math:`\frac12/(1 + e/s) + \frac12\exp(-(e/\epsilon)^2)`.

    Every segment's bend is drawn so that its own tip is uniform over its dome.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon, as a fraction of the robot's length; None for the difficulty's: 0.04,
        0.02 and 0.01 at difficulty 0, 0.5 and 1.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard".
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.
    """

    sensors = ("command", "displacement")

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
        self.n_points = POINTS * robot.n_segments
        labels = tuple(f"{axis}{k}" for k in range(1, self.n_points + 1) for axis in "xyz")
        self.goal = Goal(labels, "m", robot.length_m)
        self.metrics = tuple(error_metrics(robot.length_m, "shape_error", "shape error"))

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2), and the points of goals [m] (R, 3 K)."""
        start, shape = self.shapes(numbers)
        return start, self.predicted(shape)

    def predicted(self, bending: FloatArray) -> FloatArray:
        """Return the points [m] of shapes (..., S, 2) [rad]."""
        curve = kinematics.backbone(bending, self.robot.lengths, POINTS)[..., 1:, :]
        return curve.reshape(*curve.shape[:-2], -1)

    def achieved(self, state: RobotState) -> FloatArray:
        """Return the backbone's points [m], one after the other."""
        curve = state.backbone(POINTS)
        return curve[:, 1:].reshape(len(curve), -1)

    def squares(self, achieved: FloatArray, desired: FloatArray) -> list[FloatArray]:
        """Return the mean square of the distances [m^2]."""
        gap = achieved - desired
        return [np.vecdot(gap, gap) / self.n_points]

    def told(self, errors: list[FloatArray]) -> Mapping[str, FloatArray]:
        """Return the metrics of the error [m]."""
        return {"shape_error_m": errors[0], "shape_error_percent": errors[0] * self._percent}
