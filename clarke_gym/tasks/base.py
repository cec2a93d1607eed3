"""The protocol that every task fulfils."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number
from clarke_gym.physics.base import RobotState

Float32Array = NDArray[np.float32]


@dataclass(frozen=True)
class Metric:
    """A number that tells how well an episode went, by the name it has wherever it appears.

    Parameters
    ----------
    name : str
        Its key in `info`, in evaluations and in tables, e.g. "tip_error_m".
    label : str
        What people read, e.g. "tip error".
    unit : str
        Of the number, e.g. "m", "%", or "" for none.
    worst : float
        What an episode that failed counts as.
    """

    name: str
    label: str
    unit: str
    worst: float


class Task(Protocol):
    """What is asked of a batch of robots.

    A task reads `RobotState` and works in numbers scaled by the robot's length; it knows neither
    the physics nor the representation.
    """

    observation_size: int
    goal_size: int
    n_uniforms: int
    """Random numbers that one episode needs."""
    metrics: tuple[Metric, ...]
    """What tells how well an episode went; the first one leads in reports."""

    def sample(self, uniforms: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2) and goals in SI units (R, goal_size).

        `uniforms` has the shape (R, n_uniforms).
        """

    def achieved(self, state: RobotState) -> list[Number]:
        """Return what is compared with the goal, scaled: components rounded to float32."""

    def scale_goal(self, goal: FloatArray) -> Float32Array:
        """Return goals in the same scale, shape (R, goal_size)."""

    def reward(
        self, achieved: Sequence[Number], desired: Sequence[Number]
    ) -> tuple[Number, dict[str, Any]]:
        """Return rewards and the values for `info` from components of scaled goals."""
