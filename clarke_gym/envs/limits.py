"""The physically reachable set of commands: one rule for every representation."""

from __future__ import annotations

import math
from operator import add, sub
from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray, Number, components, not_finite
from clarke_gym._linear_map import LinearMap
from clarke_gym.physics.base import Joints, JointVector, shortened
from clarke_gym.robots import Robot

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
    sizes = np.abs(joints)
    while sizes.shape[1] > 8:  # NumPy's reduction along short rows is several times slower
        half = (sizes.shape[1] + 1) // 2
        sizes = np.maximum(sizes[:, :half], sizes[:, -half:])
    largest: FloatArray = np.maximum.reduce(np.ascontiguousarray(sizes.T))
    return largest


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
        self._off_step = robot.max_tendon_speed_m_s * control_dt
        self._encode = LinearMap(robot.encoder.T.copy())
        self._radii = robot.pitch_radii.tolist()
        self._max_bending = robot.max_bending.tolist()
        steps = robot.tendon_speeds * control_dt
        scales = robot.max_clarke if self._absolute else steps
        residual = np.eye(robot.n_joints) - robot.decoder @ robot.encoder
        self._residual = LinearMap(
            (np.repeat(scales, robot.n_tendons)[:, None] * residual).T.copy()
        )
        grams = np.array(
            [segment.matrices[1].T @ segment.matrices[1] for segment in robot.segments]
        )
        self._segments = [
            (scale, step, gram[0, 0].item(), gram[1, 1].item(), _without_rounding(2.0 * gram[0, 1]))
            for scale, step, gram in zip(scales.tolist(), steps.tolist(), grams, strict=True)
        ]

    def apply(self, action: Joints, command: JointVector) -> JointVector:
        """Return the command that follows `command` under a decoded action.

        Parameters
        ----------
        action : ndarray of shape (B, N), or list of N floats in the scalar environment
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
        if isinstance(action, list):
            length = math.hypot(*action)
            size = length * length
            finite = math.isfinite(size)
        else:
            size = np.vecdot(action, action)
            finite = math.isfinite(size.sum())
        if not finite:
            raise ValueError(not_finite(np.asarray(action)))
        if isinstance(action, list):
            flat = self._encode.of_numbers(action).tolist()
        else:
            flat = components(self._encode.of_rows(action), False)
        pairs, onto = [], 0.0
        for k, (x, y) in enumerate(command.pairs):
            scale, step, xx, yy, xy = self._segments[k]
            a, b = flat[2 * k], flat[2 * k + 1]
            # |D m|^2 from the segments' Gram matrices; the rest of |action|^2 is off the manifold.
            onto = onto + (xx * a * a + yy * b * b)
            if xy:
                onto = onto + xy * a * b
            u, v = a * scale, b * scale
            if self._absolute:
                u, v = u - x, v - y
            u, v = shortened((u, v), step)
            pairs.append((x + u, y + v))
        found = size - onto > OFF_MANIFOLD_RESOLUTION**2 * size
        decoupled = kinematics.decoupled(pairs, self._radii)
        bends = list(map(shortened, decoupled, self._max_bending))
        off = self._off_manifold(action, found, command.off_manifold)
        return JointVector(kinematics.coupled(bends, self._radii), off)

    def _off_manifold(self, action: Joints, found: Any, held: Joints | None) -> Joints | None:
        """Return the off-manifold command; `found` tells which rows of the action have one."""
        none = not found if isinstance(action, list) else not found.any()
        if none and (held is None or not self._absolute):
            return held
        if isinstance(action, list):
            zero = [0.0] * len(action)
            change = self._residual.of_numbers(action).tolist() if found else zero
            return self._moved(held or zero, change)
        changes = self._residual.of_rows(action)
        others = None if found.all() else ~found
        if others is not None:
            changes[others] = 0.0
        before = np.zeros_like(action) if held is None else held
        moved = self._moved(before, changes)
        if others is not None and not self._absolute:
            moved[others] = before[others]
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
