"""The physically reachable set of commands: one rule for every representation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import add, sub
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray, Number, components, not_finite
from clarke_gym.numerics.linear_map import LinearMap
from clarke_gym.physics.base import Joints, JointVector, shortened
from clarke_gym.robots.robot import Robot

OFF_MANIFOLD_RESOLUTION = 1e-6
"""Off-manifold parts below this share of an action are rounding (float32 actions carry 6e-8)."""


def largest_magnitude(joints: Joints) -> Any:
    """Return the largest magnitude of each row, or of the floats of the scalar environment.

    Parameters
    ----------
    joints : ndarray of shape (B, N), or list of N floats

    Returns
    -------
    ndarray of shape (B,), or float

    Examples
    --------
    >>> largest_magnitude([0.5, -2.0]), largest_magnitude(np.array([[0.5, -2.0], [1.0, 0.0]]))
    (2.0, array([2., 1.]))
    """
    if isinstance(joints, list):
        return max(max(joints), -min(joints))
    # By columns: NumPy's reduction along short rows is several times slower.
    sizes = np.array(joints.T, order="C")
    largest: FloatArray = np.maximum.reduce(np.abs(sizes, out=sizes))
    return largest


def check_finite(action: Joints) -> Any:
    """Return each row's sum of squares, or that of the floats of the scalar environment.

    Parameters
    ----------
    action : ndarray of shape (B, N), or list of N floats

    Returns
    -------
    ndarray of shape (B,), or float

    Raises
    ------
    ValueError
        If a number is not finite.

    Examples
    --------
    >>> check_finite([3.0, 4.0])
    25.0
    """
    if isinstance(action, list):
        length = math.hypot(*action)
        size: Any = length * length
        finite = math.isfinite(size)
    else:
        size = np.vecdot(action, action)
        finite = math.isfinite(size.sum())
    if not finite:
        raise ValueError(not_finite(np.asarray(action)))
    return size


@dataclass(slots=True)
class Reading:
    """Actions as the core takes them.

    Parameters
    ----------
    flat : sequence of 2S numbers
        Clarke coordinates of the decoded actions: floats in the scalar environment, or arrays (B,).
        1 is the speed limit (increment) or the largest displacement (absolute).
    off_manifold : ndarray of shape (B, N), list of N floats in the scalar environment, or None
        The change asked for off the manifold, or in absolute control the target [m]; None for none.
    rows : ndarray of bool, shape (B,), or None
        Environments that ask for one, where not all do.
    """

    flat: Sequence[Number]
    off_manifold: Joints | None = None
    rows: NDArray[np.bool_] | None = None


def _shorten(joints: Any, limit: float) -> Any:
    """Return each row shortened until no entry passes `limit`; arrays are changed in place."""
    if isinstance(joints, list):
        scale = limit / max(max(joints), -min(joints), limit)
        return joints if scale == 1.0 else [x * scale for x in joints]
    largest = largest_magnitude(joints)
    if largest.max() > limit:
        joints *= (limit / np.maximum(largest, limit))[:, None]
    return joints


def _without_rounding(number: float) -> float:
    return float(number) if abs(number) > 1e-12 else 0.0


class CommandLimits:
    """Turns actions into commands that the drives can follow.

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
        self._off_step = robot.max_tendon_speed_m_s * control_dt
        self._encode = LinearMap(robot.encoder.T.copy())
        self._radii = robot.pitch_radii.tolist()
        # With the place of a segment's first component, for loops over segments.
        places = range(0, 2 * robot.n_segments, 2)
        self._max_bending = list(zip(places, robot.max_bending.tolist(), strict=True))
        steps = robot.tendon_speeds * control_dt
        scales = robot.max_clarke if self._absolute else steps
        residual = np.eye(robot.n_joints) - robot.decoder @ robot.encoder
        self._residual = LinearMap(
            (np.repeat(scales, robot.n_tendons)[:, None] * residual).T.copy()
        )
        grams = np.array(
            [segment.matrices[1].T @ segment.matrices[1] for segment in robot.segments]
        )
        self._moves = list(zip(places, scales.tolist(), steps.tolist(), strict=True))
        self._grams = [
            (gram[0, 0].item(), gram[1, 1].item(), _without_rounding(2.0 * gram[0, 1]))
            for gram in grams
        ]

    def read(self, action: Joints) -> Reading:
        """Return a joint-space action, split into its parts on and off the manifold.

        Parameters
        ----------
        action : ndarray of shape (B, N), or list of N floats in the scalar environment
            1 is the speed limit (increment) or the largest displacement (absolute).

        Returns
        -------
        Reading

        Raises
        ------
        ValueError
            If a number is not finite.
        """
        size = check_finite(action)
        if isinstance(action, list):
            flat = self._encode.of_numbers(action).tolist()
        else:
            flat = components(self._encode.of_rows(action), False)
        onto: Number = 0.0
        for k, (xx, yy, xy) in enumerate(self._grams):
            a, b = flat[2 * k], flat[2 * k + 1]
            # |D m|^2 from the segments' Gram matrices; the rest of |action|^2 is off the manifold.
            onto = onto + (xx * a * a + yy * b * b)
            if xy:
                onto = onto + xy * a * b
        found = size - onto > OFF_MANIFOLD_RESOLUTION**2 * size
        if isinstance(action, list):
            return Reading(flat, self._residual.of_numbers(action).tolist() if found else None)
        if not found.any():
            return Reading(flat)
        changes = self._residual.of_rows(action)
        if found.all():
            return Reading(flat, changes)
        changes[~found] = 0.0
        return Reading(flat, changes, found)

    def apply(self, action: Reading, command: JointVector) -> JointVector:
        """Return the command that follows `command` under an action.

        Parameters
        ----------
        action : Reading
        command : JointVector
            The command held so far.

        Returns
        -------
        JointVector
            The new command, inside every limit.
        """
        held, flat = command.parts, action.flat
        parts: list[Number] = []
        for i, scale, step in self._moves:
            x, y = held[i], held[i + 1]
            u, v = flat[i] * scale, flat[i + 1] * scale
            if self._absolute:
                u, v = u - x, v - y
            u, v = shortened(u, v, step)
            parts += x + u, y + v
        bends = kinematics.decoupled(parts, self._radii)
        parts = []
        for i, most in self._max_bending:
            parts += shortened(bends[i], bends[i + 1], most)
        result = JointVector(kinematics.coupled(parts, self._radii), command.off_manifold)
        if action.off_manifold is not None or result.off_manifold is not None:
            result.off_manifold = self._off_manifold(action, command.off_manifold)
        return result

    def _off_manifold(self, action: Reading, held: Joints | None) -> Joints | None:
        """Return the off-manifold command."""
        change = action.off_manifold
        if change is None:
            if held is None or not self._absolute:
                return held
            change = [0.0] * len(held) if isinstance(held, list) else np.zeros_like(held)
        if isinstance(change, list):
            return self._moved(held or [0.0] * len(change), change)
        before = np.zeros_like(change) if held is None else held
        moved = self._moved(before, change)
        if action.rows is not None and not self._absolute:
            moved[~action.rows] = before[~action.rows]
        return moved

    def _moved(self, held: Any, change: Any) -> Any:
        """Return off-manifold numbers after a change, or on the way to it in absolute control.

        An array `change` is used up: new memory for large batches costs more than the sums.
        """
        if isinstance(change, list):
            if self._absolute:
                change = list(map(sub, change, held))
            change = list(map(add, held, _shorten(change, self._off_step)))
        else:
            if self._absolute:
                change -= held
            change = _shorten(change, self._off_step)
            change += held
        return _shorten(change, self._robot.max_cocontraction_m)
