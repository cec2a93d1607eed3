"""Reach: bring the tip to a goal position."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import (
    FloatArray,
    FloatMath,
    Number,
    float32,
    from_components,
    namespace,
)
from clarke_gym.numerics.checks import check_choice, check_positive
from clarke_gym.physics.base import JointVector, RobotState
from clarke_gym.robots.robot import Robot
from clarke_gym.tasks.base import Float32Array, Metric

REWARDS = ("dense", "sparse")

CLOSENESS_SCALE = 0.1
"""Tip error, as a fraction of the robot's length, at which the closeness term is one half."""


class Reach:
    r"""Reach a goal position with the tip.

    With the tip error e as a fraction of the robot's length the dense reward is the mean of two
    terms in [0, 1]: closeness :math:`1/(1 + e/0.1)`, which has a slope everywhere, and precision
    :math:`\exp(-(e/\epsilon)^2)`, which asks for the last millimetres. The sparse reward is 0 on
    success and -1 otherwise. Success means e <= tolerance.

    Goals of one segment are uniform over the dome of its tip positions. With several segments each
    segment's bend is drawn that way and the goal is the tip of that shape, so it is reachable.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
    success_tolerance : float
        Tolerance epsilon, as a fraction of the robot's length.
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.

    Raises
    ------
    ValueError
        If `reward` is unknown or `success_tolerance` is not positive and finite.
    """

    observation_size = 3
    goal_size = 3

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float = 0.02,
        random_start: bool = True,
    ) -> None:
        check_choice("reward", reward, REWARDS)
        check_positive("success_tolerance", success_tolerance)
        self.robot = robot
        self.success_tolerance = float(success_tolerance)
        self.n_uniforms = 4 * robot.n_segments
        self._length = robot.length_m
        self.metrics: tuple[
            Metric, ...
        ] = (  # no tip can be further from a goal than twice the length
            Metric("tip_error_m", "tip error", "m", 2.0 * robot.length_m),
            Metric("tip_error_percent", "tip error", "% of length", 200.0),
        )
        self._lengths = robot.lengths.tolist()
        self._sparse = reward == "sparse"
        self._random_start = bool(random_start)

    def sample(self, uniforms: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2) and goal positions [m] (R, 3).

        `uniforms` has the shape (R, n_uniforms).
        """
        pairs = uniforms.reshape(len(uniforms), 2, self.robot.n_segments, 2)
        bending = kinematics.sample_dome(pairs, self.robot.max_bending)
        start = bending[:, 0]
        ends = JointVector.from_clarke(bending[:, 1], scalar=len(bending) == 1).parts
        goal = kinematics.chain_poses(ends, self._lengths)[-1][0]
        return start if self._random_start else np.zeros_like(start), from_components(goal)

    def achieved(self, state: RobotState) -> list[Number]:
        """Return components of the tip position over the robot's length, rounded to float32."""
        (x, y, z), length = state.tip, self._length
        return float32((x / length, y / length, z / length))

    def scale_goal(self, goal: FloatArray) -> Float32Array:
        """Return goal positions over the robot's length."""
        return (goal / self._length).astype(np.float32)

    def reward(
        self, achieved: Sequence[Number], desired: Sequence[Number]
    ) -> tuple[Number, dict[str, Any]]:
        """Return rewards and the values for `info`.

        Parameters
        ----------
        achieved, desired : sequence of 3
            Components of positions over the robot's length, rounded to float32: floats or arrays.

        Returns
        -------
        reward : float or ndarray
        info : dict
            ``tip_error_m``, ``tip_error_percent`` (of the length), ``is_success`` and the terms
            ``reward_closeness`` and ``reward_precision``.
        """
        (x, y, z), (u, v, w) = achieved, desired
        xp = namespace(x)
        if xp is not FloatMath:
            x, y, z = (part.astype(np.float64) for part in (x, y, z))
        x, y, z = x - u, y - v, z - w
        error = xp.sqrt(x * x + y * y + z * z)
        success = error <= self.success_tolerance
        closeness = 0.5 / (1.0 + error / CLOSENESS_SCALE)
        ratio = error / self.success_tolerance
        precision = 0.5 * xp.exp(-xp.minimum(ratio * ratio, 700.0))  # underflow is slow
        reward = success - 1.0 if self._sparse else closeness + precision
        return reward, {
            "tip_error_m": error * self._length,
            "tip_error_percent": error * 100.0,
            "is_success": success,
            "reward_closeness": closeness,
            "reward_precision": precision,
        }
