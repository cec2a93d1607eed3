r"""Jacobians of constant-curvature poses with respect to bending vectors and lengths.

Everything follows from :math:`h = \sin(\phi/2)/\phi` and its slope in :math:`u = \phi^2`, so
nothing is singular at the straight robot. Derived here; the tests compare with differences in high
precision.
"""

from __future__ import annotations

from clarke_gym.kinematics.arcs import half_angle_functions, half_angle_slope
from clarke_gym.kinematics.poses import chain_poses
from clarke_gym.kinematics.quaternions import Components, split_segments, turned
from clarke_gym.numerics.arrays import Array, namespace, parameter, parameters
from clarke_gym.numerics.checks import check_last_axis, check_pairs


def segment_jacobian(bending: Array, length: Array | float) -> tuple[Array, Array]:
    """Return the derivatives of a segment's position and quaternion by its bending vector.

    Parameters
    ----------
    bending : array, shape (..., 2)
        Bending vector beta [rad].
    length : float or array, shape (...)
        Segment length l [m].

    Returns
    -------
    position : array, shape (..., 3, 2)
        [m/rad].
    quaternion : array, shape (..., 4, 2)
        [1/rad].

    Raises
    ------
    TypeError, ValueError
        If `bending` is not real or its last axis is not 2.

    Examples
    --------
    >>> import numpy as np
    >>> position, quaternion = segment_jacobian(np.zeros(2), 0.2)
    >>> position.round(3) + 0.0  # a straight segment moves sideways by half its length
    array([[0.1, 0. ],
           [0. , 0.1],
           [0. , 0. ]])
    """
    bending = check_last_axis(bending, 2, "bending")
    xp, length = namespace(bending), parameter(length, bending)
    position, quaternion = _arc_slopes(bending[..., 0], bending[..., 1], length)
    stacked = [xp.stack([xp.stack(row, -1) for row in m], -2) for m in (position, quaternion)]
    return stacked[0], stacked[1]


def _arc_slopes(x: Array, y: Array, length: Array) -> tuple[list[Components], list[Components]]:
    """Return the rows of the derivatives of position and quaternion, by components."""
    u = x * x + y * y
    cosine, h = half_angle_functions(u)
    slope = half_angle_slope(u, cosine, h)
    lateral, lateral_slope = 2.0 * h * h, 8.0 * h * slope  # B and 2 B'
    axial_slope = 4.0 * slope * cosine - h * h  # 2 S'
    xy, none = x * y, 0.0 * x
    position = [
        (length * (lateral + x * x * lateral_slope), length * (xy * lateral_slope)),
        (length * (xy * lateral_slope), length * (lateral + y * y * lateral_slope)),
        (length * (x * axial_slope), length * (y * axial_slope)),
    ]
    double = 2.0 * slope
    quaternion = [
        (-0.5 * x * h, -0.5 * y * h),
        (-xy * double, -h - y * y * double),
        (h + x * x * double, xy * double),
        (none, none),
    ]
    return position, quaternion


def _cross(a: Components, b: Components) -> Components:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def tip_jacobian(bending: Array, lengths: Array, *, extensible: bool = False) -> Array:
    """Return the geometric Jacobian of the tip of segments in series.

    Rows are the tip's linear velocity and then its angular velocity, both in the base frame.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    lengths : array_like, shape (S,) or (..., S)
        Segment lengths [m].
    extensible : bool
        Append S columns for the rates of the segments' lengths at constant bending vectors.

    Returns
    -------
    array, shape (..., 6, 2S) or (..., 6, 3S)
        [m/rad] and [rad/rad]; the columns of lengths in [m/m] and [rad/m].

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> import numpy as np
    >>> tip_jacobian(np.zeros((2, 2)), [0.2, 0.1])[:3].round(3) + 0.0
    array([[0.2 , 0.  , 0.05, 0.  ],
           [0.  , 0.2 , 0.  , 0.05],
           [0.  , 0.  , 0.  , 0.  ]])
    """
    bending = check_pairs(bending, lengths, "bending")
    xp, lengths = namespace(bending), parameters(lengths, bending)
    parts = split_segments(bending)
    poses = chain_poses(parts, lengths)
    tip = poses[-1][0]
    columns, stretches = [], []
    for k, length in enumerate(lengths):
        x, y = parts[2 * k], parts[2 * k + 1]
        position, quaternion = _arc_slopes(x, y, length)
        cosine, h = half_angle_functions(x * x + y * y)
        a, b = -y * h, x * h
        lever = tuple(t - p for t, p in zip(tip, poses[k][0], strict=True))
        for axis in (0, 1):
            w_, a_, b_ = (quaternion[row][axis] for row in range(3))
            # Twice the vector part of dq q*: the angular velocity in the segment's base frame.
            spin: Components = (
                2.0 * (a_ * cosine - w_ * a),
                2.0 * (b_ * cosine - w_ * b),
                2.0 * (b_ * a - a_ * b),
            )
            push: Components = tuple(row[axis] for row in position)
            if k:
                spin, push = (turned(poses[k - 1][1], v) for v in (spin, push))
            swing = _cross(spin, lever)
            columns.append((*(p + s for p, s in zip(push, swing, strict=True)), *spin))
        if extensible:
            scale = 2.0 * h
            push = (scale * x * h, scale * y * h, scale * cosine)
            push = turned(poses[k - 1][1], push) if k else push
            stretches.append((*push, *(0.0 * part for part in push)))
    return xp.stack([xp.stack(column, -1) for column in [*columns, *stretches]], -1)
