"""The protocol that every task fulfils."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray
from clarke_gym.physics.base import RobotState

Float32Array = NDArray[np.float32]


class Task(Protocol):
    """What is asked of a batch of robots.

    A task reads `RobotState` and works in numbers scaled by the robot's length; it knows neither
    the physics nor the representation.
    """

    observation_size: int
    goal_size: int
    n_uniforms: int
    """Random numbers that one episode needs."""

    def sample_start(self, uniforms: FloatArray) -> FloatArray:
        """Return start bending vectors [rad], shape (R, S, 2), from uniforms (R, n_uniforms)."""

    def sample_goal(self, uniforms: FloatArray) -> FloatArray:
        """Return goals in SI units, shape (R, goal_size), from the same uniforms."""

    def achieved(self, state: RobotState) -> Float32Array:
        """Return what is compared with the goal, scaled, shape (B, goal_size)."""

    def scale_goal(self, goal: FloatArray) -> Float32Array:
        """Return goals in the same scale, shape (R, goal_size)."""

    def reward(
        self, achieved: Float32Array, desired: Float32Array
    ) -> tuple[FloatArray, dict[str, Any]]:
        """Return rewards (B,) and the arrays for `info`: ``is_success``, reward terms."""
