"""Backlash: a tendon moves only once its drive has crossed a gap."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.disturbances.base import Disturbance, register_disturbance
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots.robot import Robot

MOST_GAP = 0.05
"""Largest gap, over the largest displacement of the first segment's tendons."""


@register_disturbance("backlash")
class Backlash(Disturbance):
    """The play operator on each tendon: its gap is drawn anew for every episode and robot.

    Source: Krasnosel'skii and Pokrovskii, "Systems with Hysteresis", 1989.
    """

    numbers: ClassVar[int] = 1

    def __init__(self, robot: Robot, num_envs: int) -> None:
        super().__init__(robot, num_envs)
        self._gap = np.zeros((num_envs, 1))
        self._held = np.zeros((num_envs, robot.n_joints))

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Draw gaps; tendons begin in the middle of them."""
        self._gap[rows] = MOST_GAP * float(self.robot.max_clarke[0]) * numbers
        self._held[rows] = command

    def step(self, command: FloatArray) -> FloatArray:
        """Return where the drives have taken the tendons to [m]."""
        half = 0.5 * self._gap
        self._held = np.clip(self._held, command - half, command + half)
        return self._held

    def get_state(self) -> dict[str, Any]:
        """Return gaps and positions."""
        return {"gap": self._gap.copy(), "held": self._held.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to them."""
        self._gap, self._held = state["gap"].copy(), state["held"].copy()
