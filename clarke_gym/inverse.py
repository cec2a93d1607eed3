r"""Inverse kinematics of constant-curvature segments, and what they can reach.

One segment has a closed form: with r the tip's distance from the base axis the bending angle is
:math:`\phi = 2\,\mathrm{atan2}(r, p_z)`. Everything is written in
:math:`t/\sin t,\; t = \phi/2`, which is smooth at the straight robot. Derived here.
"""

from __future__ import annotations

import math

import numpy as np

from clarke_gym._arrays import Array, array_namespace, as_floating, parameter
from clarke_gym.arc_functions import angle_over_sine, half_angle_functions
from clarke_gym.kinematics import segment_pose


def _check(array: Array, size: int, name: str) -> Array:
    array = as_floating(array, name)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{name} must have a last axis of {size}, got {tuple(array.shape)}")
    return array


def _tip(position: Array) -> tuple[Array, Array, Array, Array]:
    """Return position, lateral square, whole square, and t / sin t of half the bending angle."""
    position = _check(position, 3, "position")
    x, y, z = (position[..., i] for i in range(3))
    lateral = x * x + y * y
    if bool(((lateral == 0.0) & (z <= 0.0)).any()):
        raise ValueError(
            "position must not lie on the base axis at or below the base: no arc, or every closed "
            "circle, ends there"
        )
    square = lateral + z * z
    return position, lateral, square, angle_over_sine(lateral, z, square)


def segment_inverse_extensible(position: Array) -> tuple[Array, Array]:
    r"""Return bending vector and length of the one arc that ends at a position.

    :math:`l = |p|\,t/\sin t` and :math:`\beta = 2l\,(p_x, p_y)/|p|^2`.

    Parameters
    ----------
    position : array, shape (..., 3)
        Tip position [m] in the frame of the segment's base.

    Returns
    -------
    bending : array, shape (..., 2)
        [rad], below 2 pi.
    length : array, shape (...)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `position` is not real, its last axis is not 3, or it lies on the base axis at or below
        the base.

    Examples
    --------
    >>> bending, length = segment_inverse_extensible(np.array([0.0, 0.0, 0.2]))
    >>> bending, length
    (array([0., 0.]), np.float64(0.2))
    """
    position, _, square, factor = _tip(position)
    xp = array_namespace(position)
    length = xp.sqrt(square) * factor
    return 2.0 * (length / square)[..., None] * position[..., :2], length


def segment_inverse(position: Array, length: Array | float) -> tuple[Array, Array]:
    r"""Return the bending vector that points a segment of fixed length at a position.

    A segment of fixed length reaches only a surface, the dome. The tip has the direction of
    `position`; the residual :math:`|p| - l\sin(t)/t` says how far beyond (> 0) or short of the dome
    the position lies. It is not the nearest point of the dome; see `nearest_on_dome`.

    Parameters
    ----------
    position : array, shape (..., 3)
        Tip position [m] in the frame of the segment's base.
    length : float or array, shape (...)
        Segment length l [m].

    Returns
    -------
    bending : array, shape (..., 2)
        [rad], below 2 pi.
    residual : array, shape (...)
        [m].

    Raises
    ------
    TypeError, ValueError
        As `segment_inverse_extensible`.

    Examples
    --------
    >>> bending, residual = segment_inverse(np.array([0.0, 0.0, 0.25]), 0.2)
    >>> bending, residual.round(3)
    (array([0., 0.]), np.float64(0.05))
    """
    position, _, square, factor = _tip(position)
    distance = array_namespace(position).sqrt(square)
    bending = 2.0 * (factor / distance)[..., None] * position[..., :2]
    return bending, distance - parameter(length, position) / factor


def bending_from_quaternion(quaternion: Array) -> Array:
    r"""Return the bending vector of a segment from the orientation of its end.

    With the torsion-free frame of `segment_pose`, :math:`\beta = 2(t/\sin t)(q_y, -q_x)`. A turn
    about the tangent has no bending vector and is ignored. Keep the sign of the quaternion: its
    negative means the same rotation, reached by bending the other way by 2 pi - phi.

    Parameters
    ----------
    quaternion : array, shape (..., 4)
        Unit quaternions (w, x, y, z).

    Returns
    -------
    array, shape (..., 2)
        [rad].

    Raises
    ------
    TypeError, ValueError
        If `quaternion` is not real or its last axis is not 4.

    Examples
    --------
    >>> bending_from_quaternion(np.array([1.0, 0.0, 0.0, 0.0]))
    array([ 0., -0.])
    """
    quaternion = _check(quaternion, 4, "quaternion")
    xp = array_namespace(quaternion)
    w, x, y = (quaternion[..., i] for i in range(3))
    lateral = x * x + y * y
    factor = 2.0 * angle_over_sine(lateral, w, lateral + w * w)
    return xp.stack([factor * y, -factor * x], -1)


def nearest_on_dome(
    position: Array, length: Array | float, max_bending: float = 2.0 * math.pi
) -> tuple[Array, Array]:
    """Return the bending vector whose tip is nearest to a position, and the distance left.

    Golden-section search over the bending angle, the direction being that of the position.

    Parameters
    ----------
    position : ndarray, shape (..., 3)
        [m].
    length : float or ndarray, shape (...)
        Segment length l [m].
    max_bending : float
        Bending limit [rad], at most 2 pi.

    Returns
    -------
    bending : ndarray, shape (..., 2)
        [rad].
    distance : ndarray, shape (...)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `position` is not real or its last axis is not 3.

    Examples
    --------
    >>> bending, distance = nearest_on_dome(np.array([0.0, 0.0, 0.25]), 0.2)
    >>> np.abs(bending).max() < 1e-6, round(float(distance), 6)
    (np.True_, 0.05)
    """
    position = np.asarray(_check(position, 3, "position"), np.float64)
    length = parameter(length, position)
    radius = np.hypot(position[..., 0], position[..., 1])
    axial = position[..., 2]

    def gap(phi: Array) -> Array:
        cosine, h = half_angle_functions(phi * phi)
        scale = 2.0 * length * h if isinstance(length, float) else 2.0 * length[..., None] * h
        return np.hypot(scale * phi * h - radius[..., None], scale * cosine - axial[..., None])

    grid = np.linspace(0.0, max_bending, 129)
    best = grid[np.argmin(gap(np.broadcast_to(grid, (*radius.shape, 129))), axis=-1)]
    low, high = np.maximum(best - grid[1], 0.0), np.minimum(best + grid[1], max_bending)
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(60):
        span = golden * (high - low)
        left, right = high - span, low + span
        both = gap(np.stack([left, right], axis=-1))
        lower = both[..., 0] < both[..., 1]
        low, high = np.where(lower, low, left), np.where(lower, right, high)
    phi = (low + high) / 2.0
    safe = np.where(radius > 0.0, radius, 1.0)
    direction = np.where(radius[..., None] > 0.0, position[..., :2] / safe[..., None], [1.0, 0.0])
    bending = phi[..., None] * direction
    reached, _ = segment_pose(bending, length)
    return bending, np.linalg.norm(reached - position, axis=-1)


def is_reachable(
    position: Array,
    length: float | tuple[float, float],
    max_bending: float,
    tolerance_m: float = 1e-9,
) -> Array:
    """Return whether one segment's tip can be brought to a position.

    Parameters
    ----------
    position : array, shape (..., 3)
        [m].
    length : float or (shortest, longest)
        Segment length, or its range if the segment is extensible [m].
    max_bending : float
        Bending limit [rad].
    tolerance_m : float
        Error that counts as reached [m].

    Returns
    -------
    ndarray of bool, shape (...)

    Raises
    ------
    TypeError, ValueError
        If `position` is not real or its last axis is not 3.

    Examples
    --------
    >>> tip = np.array([[0.0, 0.0, 0.2], [0.0, 0.0, 0.21]])
    >>> is_reachable(tip, 0.2, 1.5), is_reachable(tip, (0.19, 0.22), 1.5)
    (array([ True, False]), array([ True,  True]))
    """
    if not isinstance(length, tuple):
        return nearest_on_dome(position, length, max_bending)[1] <= tolerance_m
    position = _check(position, 3, "position")
    on_axis = (position[..., :2] == 0.0).all(-1) & (position[..., 2] <= 0.0)
    safe = np.where(on_axis[..., None], [0.0, 0.0, 1.0], position)
    bending, arc = segment_inverse_extensible(safe)
    inside = (arc >= length[0] - tolerance_m) & (arc <= length[1] + tolerance_m)
    slack = tolerance_m / arc  # an angle that moves the tip by less than the tolerance
    return inside & (np.linalg.norm(bending, axis=-1) <= max_bending + slack) & ~on_axis
