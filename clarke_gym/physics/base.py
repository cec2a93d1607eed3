"""The protocol that every physics model fulfils, and the state that tasks read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray, map_rows
from clarke_gym.robots import Robot


@dataclass(slots=True)
class JointVector:
    """A batch of joint-space vectors, split by the projector into two orthogonal parts.

    Parameters
    ----------
    clarke : ndarray, shape (B, S, 2)
        Clarke coordinates of each segment's tendons [m]: the part on the manifold.
    off_manifold : ndarray of shape (B, N), or None
        The rest, (I - P) rho [m]; None where no row has any.
    """

    clarke: FloatArray
    off_manifold: FloatArray | None = None

    def joint(self, robot: Robot) -> FloatArray:
        """Return the displacements rho [m], shape (B, N)."""
        rho = map_rows(self.clarke.reshape(len(self.clarke), -1), robot.decoder.T)
        return rho if self.off_manifold is None else rho + self.off_manifold


@dataclass(slots=True)
class RobotState:
    """What a task and an observation may know of the robot, whichever physics made it.

    Parameters
    ----------
    displacement : JointVector
        Achieved tendon displacements [m].
    tip_position : ndarray, shape (B, 3)
        [m], base frame.
    tip_quaternion : ndarray, shape (B, 4)
        (w, x, y, z), base frame.
    diverged : ndarray of bool, shape (B,)
        True where the simulation broke down; the episode ends there.
    """

    displacement: JointVector
    tip_position: FloatArray
    tip_quaternion: FloatArray
    diverged: NDArray[np.bool_]


class Physics(Protocol):
    """A batch of B equal robots advanced by one control period at a time."""

    robot: Robot
    num_envs: int
    displacement_bound: float
    """Largest achieved displacement over the largest commanded one."""

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""

    def reset(self, rows: NDArray[np.intp], clarke: FloatArray) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2)."""

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements."""

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""
