r"""Inverse kinematics of one constant-curvature segment in closed form.

One segment has a closed form: with r the tip's distance from the base axis the bending angle is
:math:`\phi = 2\,\mathrm{atan2}(r, p_z)`. Everything is written in
:math:`t/\sin t,\; t = \phi/2`, which is smooth at the straight robot. Derived here.
"""

from __future__ import annotations

from clarke_gym.kinematics.arcs import angle_over_sine
from clarke_gym.numerics.arrays import Array, array_namespace, parameter
from clarke_gym.numerics.checks import check_last_axis


def _tip(position: Array) -> tuple[Array, Array, Array, Array]:
    """Return position, lateral square, whole square, and t / sin t of half the bending angle."""
    position = check_last_axis(position, 3, "position")
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
    >>> import numpy as np
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
    the position lies. It is not the nearest point of the dome, which `nearest_on_dome` of
    `clarke_gym.kinematics.reachability` finds.

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
    >>> import numpy as np
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
    >>> import numpy as np
    >>> bending_from_quaternion(np.array([1.0, 0.0, 0.0, 0.0]))
    array([ 0., -0.])
    """
    quaternion = check_last_axis(quaternion, 4, "quaternion")
    xp = array_namespace(quaternion)
    w, x, y = (quaternion[..., i] for i in range(3))
    lateral = x * x + y * y
    factor = 2.0 * angle_over_sine(lateral, w, lateral + w * w)
    return xp.stack([factor * y, -factor * x], -1)
