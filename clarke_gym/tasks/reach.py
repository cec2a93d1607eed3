"""Reach: bring the tip to a goal position."""

from __future__ import annotations

from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot, require_positive
from clarke_gym.tasks.base import Float32Array

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
        if reward not in REWARDS:
            raise ValueError(f"reward must be one of {list(REWARDS)}, got {reward!r}")
        require_positive("success_tolerance", success_tolerance)
        self.robot = robot
        self.success_tolerance = float(success_tolerance)
        self.n_uniforms = 4 * robot.n_segments
        self._sparse = reward == "sparse"
        self._random_start = bool(random_start)

    def _bending(self, uniforms: FloatArray) -> FloatArray:
        pairs = uniforms.reshape(len(uniforms), self.robot.n_segments, 2)
        return kinematics.sample_dome(pairs, self.robot.max_bending)

    def sample_start(self, uniforms: FloatArray) -> FloatArray:
        """Return start bending vectors [rad], shape (R, S, 2), from uniforms (R, n_uniforms)."""
        bending = self._bending(uniforms[:, : self.n_uniforms // 2])
        return bending if self._random_start else np.zeros_like(bending)

    def sample_goal(self, uniforms: FloatArray) -> FloatArray:
        """Return goal positions [m], shape (R, 3), from the same uniforms."""
        bending = self._bending(uniforms[:, self.n_uniforms // 2 :])
        goal: FloatArray = kinematics.forward(bending, self.robot.lengths)[0]
        return goal

    def achieved(self, state: RobotState) -> Float32Array:
        """Return tip positions over the robot's length, shape (B, 3)."""
        return (state.tip_position / self.robot.length_m).astype(np.float32)

    def scale_goal(self, goal: FloatArray) -> Float32Array:
        """Return goal positions over the robot's length."""
        return (goal / self.robot.length_m).astype(np.float32)

    def reward(
        self, achieved: Float32Array, desired: Float32Array
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Return rewards and the arrays for `info`.

        Parameters
        ----------
        achieved, desired : ndarray of float32, shape (..., 3)
            Positions over the robot's length.

        Returns
        -------
        reward : ndarray, shape (...)
        info : dict of ndarray, shape (...)
            ``tip_error_m``, ``tip_error_percent`` (of the length), ``is_success`` and the terms
            ``reward_closeness`` and ``reward_precision``.
        """
        gap = np.subtract(achieved, desired, dtype=np.float64)
        gap *= gap
        error = np.sqrt(gap[..., 0] + gap[..., 1] + gap[..., 2])
        success = error <= self.success_tolerance
        closeness = 0.5 / (1.0 + error / CLOSENESS_SCALE)
        ratio = error / self.success_tolerance
        precision = 0.5 * np.exp(-ratio * ratio)
        reward = success - 1.0 if self._sparse else closeness + precision
        info = {
            "tip_error_m": error * self.robot.length_m,
            "tip_error_percent": error * 100.0,
            "is_success": success,
            "reward_closeness": closeness,
            "reward_precision": precision,
        }
        return reward, info
