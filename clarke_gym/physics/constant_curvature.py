"""Constant-curvature physics: taut tendons, quasi-static shape, first-order drives."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray
from clarke_gym.physics.base import JointVector, RobotState
from clarke_gym.robots import Robot


class ConstantCurvature:
    r"""A batch of robots whose segments are circular arcs.

    All tendons are taut, so the shape follows :math:`P\rho` alone and the off-manifold part only
    raises internal tension. The drives follow their command with the time constant tau; one
    control period of length T closes the gap by the exact factor :math:`1 - e^{-T/\tau}`.

    Parameters
    ----------
    robot : Robot
    num_envs : int
        Batch size B.
    control_dt : float
        Control period T [s].

    Examples
    --------
    >>> physics = ConstantCurvature(Robot(), 1, 0.05)
    >>> physics.reset(np.array([0]), np.zeros((1, 1, 2)))
    >>> physics.step(JointVector(np.array([[[0.001, 0.0]]])))
    >>> float(physics.state.displacement.clarke[0, 0, 0].round(6))  # 1 - 1/e of the command
    0.000632
    """

    displacement_bound = 1.0

    def __init__(self, robot: Robot, num_envs: int, control_dt: float) -> None:
        self.robot = robot
        self.num_envs = num_envs
        tau = robot.actuator_time_constant_s
        self._gain = 1.0 if tau == 0.0 else -math.expm1(-control_dt / tau)
        self._clarke = np.zeros((num_envs, robot.n_segments, 2))
        self._off_manifold: FloatArray | None = None
        self._diverged = np.zeros(num_envs, dtype=bool)
        self._state: RobotState | None = None

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""
        if self._state is None:
            bending = kinematics.clarke_to_bending(self._clarke, self.robot.pitch_radii)
            position, quaternion = kinematics.forward(bending, self.robot.lengths)
            displacement = JointVector(self._clarke, self._off_manifold)
            self._state = RobotState(displacement, position, quaternion, self._diverged)
        return self._state

    def reset(self, rows: NDArray[np.intp], clarke: FloatArray) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2)."""
        self._clarke = self._clarke.copy()
        self._clarke[rows] = clarke
        if self._off_manifold is not None:
            self._off_manifold = self._off_manifold.copy()
            self._off_manifold[rows] = 0.0
        self._state = None

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements."""
        self._clarke = self._clarke + self._gain * (command.clarke - self._clarke)
        if command.off_manifold is not None:
            previous = 0.0 if self._off_manifold is None else self._off_manifold
            self._off_manifold = previous + self._gain * (command.off_manifold - previous)
        self._state = None

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""
        bending = kinematics.clarke_to_bending(self._clarke, self.robot.pitch_radii)
        curve: FloatArray = kinematics.backbone(bending, self.robot.lengths, points)
        return curve

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""
        off = self._off_manifold
        return {
            "clarke": self._clarke.copy(),
            "off_manifold": None if off is None else off.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""
        off = state["off_manifold"]
        self._clarke = state["clarke"].copy()
        self._off_manifold = None if off is None else off.copy()
        self._state = None
