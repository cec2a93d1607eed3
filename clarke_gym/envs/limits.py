"""The physically reachable set of commands: one rule for every representation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray, Number, components, map_rows, namespace, not_finite
from clarke_gym.physics.base import JointVector, Pair
from clarke_gym.robots import Robot

OFF_MANIFOLD_RESOLUTION = 1e-6
"""Off-manifold parts below this share of an action are rounding (float32 actions carry 6e-8)."""


def saturate(x: Number, y: Number, limit: float) -> Pair:
    """Return a vector shortened to at most `limit`, its direction kept."""
    xp = namespace(x)
    length = xp.sqrt(x * x + y * y)
    scale = limit / xp.maximum(length, limit)
    return x * scale, y * scale


def largest_magnitude(rows: FloatArray) -> Any:
    """Return the largest magnitude in each row; the few numbers of one row as floats, faster."""
    if len(rows) == 1:
        values = rows[0].tolist()
        return [max(max(values), -min(values))]
    magnitudes: FloatArray = np.maximum.reduce(np.abs(rows), axis=1)
    return magnitudes


def _saturate_rows(rows: FloatArray, limit: float) -> FloatArray:
    if len(rows) == 1:
        top = largest_magnitude(rows)[0]
        return rows if top <= limit else rows * (limit / top)
    largest = largest_magnitude(rows)[:, None]
    if largest.max() <= limit:
        return rows
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
    scalar : bool
        Compute with Python floats: for the scalar environment.
    """

    def __init__(self, robot: Robot, control: str, control_dt: float, scalar: bool = False) -> None:
        self._robot = robot
        self._absolute = control == "absolute"
        self._scalar = scalar
        self._off_step = robot.max_tendon_speed_m_s * control_dt
        self._encoder = robot.encoder.T.copy()
        self._radii = robot.pitch_radii.tolist()
        self._max_bending = robot.max_bending.tolist()
        steps = robot.tendon_speeds * control_dt
        self._steps = steps.tolist()
        scales = robot.max_clarke if self._absolute else steps
        self._scales = scales.tolist()
        residual = np.eye(robot.n_joints) - robot.decoder @ robot.encoder
        self._residual = (np.repeat(scales, robot.n_tendons)[:, None] * residual).T.copy()
        grams = [segment.matrices[1].T @ segment.matrices[1] for segment in robot.segments]
        cross = [2.0 * float(g[0, 1]) if abs(g[0, 1]) > 1e-12 else 0.0 for g in grams]
        self._grams = [
            (float(g[0, 0]), float(g[1, 1]), c) for g, c in zip(grams, cross, strict=True)
        ]

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
        size: Number
        if self._scalar:
            size = 0.0
            for number in action[0].tolist():
                size += number * number
            finite = math.isfinite(size)
        else:
            size = np.einsum("bn,bn->b", action, action)
            finite = math.isfinite(size.sum())
        if not finite:
            raise ValueError(not_finite(action))
        flat = components(map_rows(action, self._encoder), self._scalar)
        coordinates = list(zip(flat[0::2], flat[1::2], strict=True))
        pairs = []
        rows = zip(coordinates, command.pairs, self._scales, self._steps, strict=True)
        for (a, b), (x, y), scale, step in rows:
            u, v = a * scale, b * scale
            if self._absolute:
                u, v = u - x, v - y
            u, v = saturate(u, v, step)
            pairs.append((x + u, y + v))
        decoupled = kinematics.decoupled(pairs, self._radii)
        bends = [
            saturate(bend[0], bend[1], limit)
            for bend, limit in zip(decoupled, self._max_bending, strict=True)
        ]
        off = self._off_manifold(action, coordinates, size, command.off_manifold)
        return JointVector(kinematics.coupled(bends, self._radii), off)

    def _off_manifold(
        self,
        action: FloatArray,
        coordinates: Sequence[Pair],
        size: Number,
        held: FloatArray | None,
    ) -> FloatArray | None:
        """Return the off-manifold command; that there is none costs one product to know."""
        onto = 0.0  # |D m|^2 from the segments' Gram matrices; the rest is off the manifold
        for (x, y), (xx, yy, xy) in zip(coordinates, self._grams, strict=True):
            onto = onto + (xx * x * x + yy * y * y)
            if xy:
                onto = onto + xy * x * y
        off_rows = size - onto > OFF_MANIFOLD_RESOLUTION**2 * size
        found = off_rows if self._scalar else off_rows.any()
        if held is None:
            if not found:
                return None
            held = np.zeros_like(action)
        elif not (self._absolute or found):
            return held
        change = map_rows(action, self._residual)
        if not found:
            change[:] = 0.0
        elif not self._scalar:
            change[~off_rows] = 0.0
        if self._absolute:
            change -= held
        change = _saturate_rows(change, self._off_step)
        return _saturate_rows(held + change, self._robot.max_cocontraction_m)
