"""The physically reachable set of commands: one rule for every representation."""

from __future__ import annotations

import numpy as np

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray, map_rows
from clarke_gym.physics.base import JointVector
from clarke_gym.robots import Robot

OFF_MANIFOLD_RESOLUTION = 1e-6
"""Off-manifold parts below this share of an action are rounding (float32 actions carry 6e-8)."""


def saturate(pairs: FloatArray, limit: FloatArray | float) -> FloatArray:
    """Return vectors (..., 2) shortened to at most `limit`, their direction kept."""
    x, y = pairs[..., 0], pairs[..., 1]
    length = np.sqrt(x * x + y * y)
    scale: FloatArray = limit / np.maximum(length, limit)
    return pairs * scale[..., None]


def _saturate_rows(rows: FloatArray, limit: float) -> FloatArray:
    largest = np.abs(rows).max(axis=1, keepdims=True)
    result: FloatArray = rows * (limit / np.maximum(largest, limit))
    return result


class CommandLimits:
    """Turns decoded actions into commands that the drives can follow.

    The part of an increment on the manifold is saturated radially, segment by segment, at the
    tendons' speed limit; so is the resulting bend at its limit. The off-manifold part is scaled
    down where a tendon would pass the speed or the co-contraction limit.

    Parameters
    ----------
    robot : Robot
    control : {"increment", "absolute"}
    control_dt : float
        Control period [s].
    """

    def __init__(self, robot: Robot, control: str, control_dt: float) -> None:
        self._robot = robot
        self._absolute = control == "absolute"
        self._step = robot.max_tendon_speed_m_s * control_dt
        self._encoder = robot.encoder.T.copy()
        gram = robot.decoder.T @ robot.decoder
        self._gram = None if np.allclose(gram, np.diag(np.diag(gram))) else gram
        self._gram_diagonal = np.diag(gram).copy()
        scale = robot.max_clarke[:, None] if self._absolute else np.array(self._step)
        self._clarke_scale = scale
        self._joint_scale = np.repeat(robot.max_clarke, robot.n_tendons)
        if not self._absolute:
            self._joint_scale = np.full(robot.n_joints, self._step)

    def apply(self, action: FloatArray, command: JointVector) -> JointVector:
        """Return the command that follows `command` under a decoded action.

        Parameters
        ----------
        action : ndarray, shape (B, N)
            Decoded action; 1 is the speed limit (increment) or the largest displacement (absolute).
        command : JointVector
            The command held so far.

        Returns
        -------
        JointVector
            The new command, inside every limit.

        Raises
        ------
        ValueError
            If a number is not finite.
        """
        robot = self._robot
        coordinates = map_rows(action, self._encoder)
        size = np.einsum("bn,bn->b", action, action)
        if not np.isfinite(size).all():
            row = int(np.argmin(np.isfinite(size)))
            raise ValueError(f"action must be finite, got {action[row].tolist()} (row {row})")
        increment = coordinates.reshape(-1, robot.n_segments, 2) * self._clarke_scale
        if self._absolute:
            increment = increment - command.clarke
        clarke = command.clarke + saturate(increment, self._step)
        bending = kinematics.clarke_to_bending(clarke, robot.pitch_radii)
        bending = saturate(bending, robot.max_bending)
        clarke = kinematics.bending_to_clarke(bending, robot.pitch_radii)
        return JointVector(clarke, self._off_manifold(action, coordinates, size, command))

    def _off_manifold(
        self,
        action: FloatArray,
        coordinates: FloatArray,
        size: FloatArray,
        command: JointVector,
    ) -> FloatArray | None:
        """Return the off-manifold command; the common case of none at all costs one product."""
        squares = coordinates * coordinates
        onto = np.zeros_like(size)
        for k in range(squares.shape[1]):  # over 2S coordinates, in an order no batch changes
            onto += squares[:, k] * self._gram_diagonal[k]
        if self._gram is not None:
            for s in range(self._robot.n_segments):
                cross = 2.0 * self._gram[2 * s, 2 * s + 1]
                onto += cross * coordinates[:, 2 * s] * coordinates[:, 2 * s + 1]
        off_rows = size - onto > OFF_MANIFOLD_RESOLUTION**2 * size
        previous = command.off_manifold
        if previous is None:
            if not off_rows.any():
                return None
            previous = np.zeros_like(action)
        elif not (self._absolute or off_rows.any()):
            return previous
        residual = action - map_rows(coordinates, self._robot.decoder.T)
        residual[~off_rows] = 0.0
        change = residual * self._joint_scale
        if self._absolute:
            change -= previous
        change = _saturate_rows(change, self._step)
        return _saturate_rows(previous + change, self._robot.max_cocontraction_m)
