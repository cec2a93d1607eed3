"""What one constant-curvature segment can reach: the nearest tip, and whether it is there."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from clarke_gym.kinematics.arcs import half_angle_functions, half_angle_slope
from clarke_gym.kinematics.inverse import segment_inverse_extensible
from clarke_gym.kinematics.poses import segment_pose
from clarke_gym.numerics.arrays import Array, array_namespace, matrix_like, parameter
from clarke_gym.numerics.checks import check_last_axis


def nearest_on_dome(
    position: Array, length: Array | float, max_bending: float = 2.0 * math.pi
) -> tuple[Array, Array]:
    r"""Return the bending vector whose tip is nearest to a position, and the distance left.

    A search over the bending angle, the direction being that of the position, finds the angle to a
    few digits; Newton steps on the derivative of the squared distance do the rest. With
    :math:`S = \sin\phi/\phi` the tip lies at :math:`r/l = 2\phi h^2,\ z/l = S`, and
    :math:`S'' = -S - 2S'/\phi`.

    Parameters
    ----------
    position : array, shape (..., 3)
        [m].
    length : float or array, shape (...)
        Segment length l [m].
    max_bending : float
        Bending limit [rad], at most 2 pi.

    Returns
    -------
    bending : array, shape (..., 2)
        [rad]. Torch gradients are those of the minimiser; zero in the angle at its limit.
    distance : array, shape (...)
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
    position = check_last_axis(position, 3, "position")
    xp, length = array_namespace(position), parameter(length, position)
    square = position[..., 0] * position[..., 0] + position[..., 1] * position[..., 1]
    off_axis = square > 0.0
    radius = xp.where(off_axis, xp.sqrt(xp.where(off_axis, square, xp.ones_like(square))), 0.0)
    radial, axial = radius / length, position[..., 2] / length
    fixed = [part.detach() if xp is not np else np.asarray(part) for part in (radial, axial)]
    phi = _nearest_angle(xp, fixed[0], fixed[1], max_bending)
    for _ in range(3):
        step, _ = _newton(phi, fixed[0], fixed[1], max_bending)
        phi = xp.clip(phi - step, 0.0, max_bending)
    step, slope = _newton(phi, radial, axial, max_bending)  # carries the gradients
    phi = phi - step
    safe = xp.where(off_axis, radius, xp.ones_like(radius))[..., None]
    straight = (slope / length)[..., None] * position[..., :2]  # phi over radius has this limit
    aside = phi[..., None] * matrix_like(np.array([1.0, 0.0]), position)
    centre = xp.where((phi > 1e-6)[..., None], aside, straight)
    bending = xp.where(off_axis[..., None], phi[..., None] * (position[..., :2] / safe), centre)
    gap = segment_pose(bending, length)[0] - position
    left = (gap * gap).sum(-1)
    apart = left > 0.0
    return bending, xp.where(apart, xp.sqrt(xp.where(apart, left, xp.ones_like(left))), 0.0)


def _nearest_angle(xp: Any, radial: Array, axial: Array, max_bending: float) -> Array:
    """Return the bending angle nearest to a point of the bending plane, to about 8 digits."""

    def gap(phi: Array) -> Array:
        cosine, h = half_angle_functions(phi * phi)
        return xp.hypot(2.0 * phi * h * h - radial[..., None], 2.0 * h * cosine - axial[..., None])

    grid = matrix_like(np.linspace(0.0, max_bending, 129), axial)
    best = grid[xp.argmin(gap(xp.broadcast_to(grid, (*radial.shape, 129))), -1)]
    low, high = (xp.clip(best + side * grid[1], 0.0, max_bending) for side in (-1.0, 1.0))
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(40):
        span = golden * (high - low)
        left, right = high - span, low + span
        both = gap(xp.stack([left, right], -1))
        lower = both[..., 0] < both[..., 1]
        low, high = xp.where(lower, low, left), xp.where(lower, right, high)
    return (low + high) / 2.0


def _newton(phi: Array, radial: Array, axial: Array, max_bending: float) -> tuple[Array, Array]:
    """Return the Newton step towards the nearest angle, and how the angle moves with `radial`."""
    xp = array_namespace(phi)
    u = phi * phi
    cosine, h = half_angle_functions(u)
    slope = half_angle_slope(u, cosine, h)
    s, t = 2.0 * h * cosine, 4.0 * slope * cosine - h * h  # S and S' / phi
    r, r1, r2 = 2.0 * phi * h * h, s - 2.0 * h * h, phi * (t - 8.0 * h * slope)
    z1, z2 = phi * t, -s - 2.0 * t
    curvature = r1 * r1 + z1 * z1 + r2 * (r - radial) + z2 * (s - axial)
    curvature = curvature if xp is np else curvature.detach()
    inside = (curvature > 1e-9) & (phi < max_bending)
    safe = xp.where(inside, curvature, xp.ones_like(curvature))
    zero = xp.zeros_like(phi)
    step = xp.where(inside, (r1 * (r - radial) + z1 * (s - axial)) / safe, zero)
    return step, xp.where(inside, r1 / safe, zero)


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
    array of bool, shape (...)

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
    position = check_last_axis(position, 3, "position")
    on_axis = (position[..., :2] == 0.0).all(-1) & (position[..., 2] <= 0.0)
    xp = array_namespace(position)
    above = matrix_like(np.array([0.0, 0.0, 1.0]), position)
    bending, arc = segment_inverse_extensible(xp.where(on_axis[..., None], above, position))
    inside = (arc >= length[0] - tolerance_m) & (arc <= length[1] + tolerance_m)
    slack = tolerance_m / arc  # an angle that moves the tip by less than the tolerance
    angle = xp.sqrt((bending * bending).sum(-1))
    return inside & (angle <= max_bending + slack) & ~on_axis
