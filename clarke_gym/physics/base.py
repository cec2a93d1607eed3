"""The protocol that every physics model fulfils, and the state that tasks read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number, components, from_components
from clarke_gym.numerics.linear_map import map_rows
from clarke_gym.robots.robot import Robot

Joints: TypeAlias = FloatArray | list[float]
"""Numbers of all tendons: an array (B, N), or N floats in the scalar environment."""


@dataclass(slots=True)
class JointVector:
    """A batch of joint-space vectors, split by the projector into two orthogonal parts.

    Parameters
    ----------
    parts : list of 2S numbers
        Clarke coordinates of the segments' tendons [m], the part on the manifold, in the order of
        the robot's encoder: floats in the scalar environment, arrays of shape (B,) in a batch.
    off_manifold : ndarray of shape (B, N), list of N floats in the scalar environment, or None
        The rest, (I - P) rho [m]; None where no row has any.
    """

    parts: list[Number]
    off_manifold: Joints | None = None

    @classmethod
    def from_clarke(
        cls, clarke: FloatArray, off_manifold: Joints | None = None, scalar: bool = False
    ) -> JointVector:
        """Make a vector from Clarke coordinates of shape (B, S, 2)."""
        return cls(components(clarke.reshape(len(clarke), -1), scalar), off_manifold)

    @property
    def clarke(self) -> FloatArray:
        """Clarke coordinates [m], shape (B, S, 2)."""
        array = from_components(self.parts)
        return array.reshape(len(array), -1, 2)

    def joint(self, robot: Robot) -> FloatArray:
        """Return the displacements rho [m], shape (B, N)."""
        rho = map_rows(from_components(self.parts), robot.decoder.T)
        return rho if self.off_manifold is None else rho + self.off_manifold

    def rows(self, pick: NDArray[np.intp]) -> JointVector:
        """Return some robots' part of a batch; of the scalar environment, the whole."""
        if isinstance(self.parts[0], float):
            return self
        off: Any = self.off_manifold
        return JointVector([part[pick] for part in self.parts], None if off is None else off[pick])

    def with_rows(self, rows: NDArray[np.intp], clarke: FloatArray) -> JointVector:
        """Return a copy with some robots on the manifold at `clarke` (rows, S, 2)."""
        if isinstance(self.parts[0], float):
            return JointVector.from_clarke(clarke, scalar=True) if len(rows) else self
        parts = [part.copy() for part in self.parts]
        for part, column in zip(
            parts, components(clarke.reshape(len(rows), -1), False), strict=True
        ):
            part[rows] = column
        off: Any = self.off_manifold
        if off is not None:
            off = off.copy()
            off[rows] = 0.0
        return JointVector(parts, off)

    def broken(self) -> NDArray[np.bool_] | None:
        """Return which robots' vectors hold what is no finite number; None for none."""
        off: Any = self.off_manifold
        total: Any = sum(self.parts)
        if isinstance(total, float):
            total = total if off is None else total + sum(off)
            return None if math.isfinite(total) else np.array([True])
        total = total if off is None else total + off.sum(1)
        return None if math.isfinite(total.sum()) else np.logical_not(np.isfinite(total))

    def get_state(self) -> dict[str, Any]:
        """Return a copy as arrays and lists."""
        off = self.off_manifold
        return {"clarke": self.clarke, "off_manifold": None if off is None else off.copy()}

    @classmethod
    def from_state(cls, state: dict[str, Any], scalar: bool) -> JointVector:
        """Return the vector of `get_state`, bit for bit."""
        off = state["off_manifold"]
        return cls.from_clarke(state["clarke"], None if off is None else off.copy(), scalar)


def shortened(x: Number, y: Number, limit: float) -> tuple[Number, Number]:
    """Return a vector shortened to at most a limit, its direction kept.

    Parameters
    ----------
    x, y : float or array
        Components.
    limit : float

    Returns
    -------
    tuple of 2

    Examples
    --------
    >>> shortened(3.0, 4.0, 10.0), shortened(3.0, 4.0, 2.5)
    ((3.0, 4.0), (1.5, 2.0))
    """
    if isinstance(x, float):
        length = math.sqrt(x * x + y * y)
        if length <= limit:
            return x, y
        scale: Number = limit / length
    else:
        scale = limit / np.maximum(np.sqrt(x * x + y * y), limit)
    return x * scale, y * scale


@dataclass(slots=True)
class RobotState:
    """What a task and an observation may know of the robot, whichever physics made it.

    Parameters
    ----------
    displacement : JointVector
        Achieved tendon displacements [m].
    tip : tuple of 3
        Components of the tip position [m], base frame; each a float or an array (B,).
    quaternion : tuple of 4
        Components (w, x, y, z) of the tip orientation, base frame.
    diverged : ndarray of bool, shape (B,)
        True where the simulation broke down; the episode ends there.
    """

    displacement: JointVector
    tip: Sequence[Number]
    quaternion: Sequence[Number]
    diverged: NDArray[np.bool_]

    @property
    def tip_position(self) -> FloatArray:
        """Tip position [m], shape (B, 3)."""
        return from_components(self.tip)

    @property
    def tip_quaternion(self) -> FloatArray:
        """Tip orientation (w, x, y, z), shape (B, 4)."""
        return from_components(self.quaternion)


class Physics(Protocol):
    """A batch of B equal robots advanced by one control period at a time."""

    robot: Robot
    num_envs: int
    displacement_bound: float
    """Largest achieved displacement over the largest commanded one."""

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""

    def rest(self, clarke: FloatArray) -> FloatArray:
        """Return the model's own coordinates (R, k) of robots at rest at `clarke` (R, S, 2)."""

    def reset(
        self, rows: NDArray[np.intp], clarke: FloatArray, rest: FloatArray | None = None
    ) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2).

        Who knows `self.rest(clarke)` already may give it as `rest`.
        """

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements."""

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""
