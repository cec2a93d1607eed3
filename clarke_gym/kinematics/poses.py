r"""Constant-curvature kinematics without singularities: bending vectors to poses.

Base frame: z is the tangent of the straight robot. A segment of length l and curvature kappa in the
plane at angle theta has the bending vector :math:`\beta = l\kappa(\cos\theta, \sin\theta) = (x, y)`
and the bending angle :math:`\phi = |\beta|`. With :math:`h = \sin(\phi/2)/\phi`

.. math:: p = l(2h^2x,\; 2h^2y,\; 2h\cos(\phi/2)), \qquad q = (\cos(\phi/2), -yh, xh, 0)

(half-angle form of the arc geometry of Webster and Jones, IJRR 2010). Unlike
:math:`(1-\cos\phi)/\phi^2`, h loses no digit near zero curvature, so no branch is needed there.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from clarke_gym.kinematics.arcs import half_angle_functions
from clarke_gym.kinematics.quaternions import (
    Components,
    product,
    rotation_rows,
    split_segments,
    turned,
)
from clarke_gym.numerics.arrays import (
    Array,
    Number,
    matrix_like,
    namespace,
    parameter,
    parameters,
)
from clarke_gym.numerics.checks import check_last_axis, check_pairs


def arc_pose(x: Number, y: Number, length: Number) -> tuple[Components, Components]:
    """Return position and quaternion of an arc's end, by components.

    Parameters
    ----------
    x, y : float or array
        Components of the bending vector [rad].
    length : float or array
        Arc length l [m].

    Returns
    -------
    position : tuple of 3
        [m].
    quaternion : tuple of 4
        Unit quaternion (w, x, y, z).

    Examples
    --------
    >>> arc_pose(0.0, 0.0, 0.2)[0]
    (0.0, 0.0, 0.2)
    """
    cosine, h = half_angle_functions(x * x + y * y)
    xh, yh = x * h, y * h
    scale = 2.0 * length * h
    return (scale * xh, scale * yh, scale * cosine), (cosine, -yh, xh, 0.0 * xh)


def segment_pose(bending: Array, length: Array | float) -> tuple[Array, Array]:
    """Return the pose of a segment's end in the frame of its base.

    Parameters
    ----------
    bending : array, shape (..., 2)
        Bending vector beta [rad].
    length : float or array, shape (...)
        Segment length l [m].

    Returns
    -------
    position : array, shape (..., 3)
        [m].
    quaternion : array, shape (..., 4)
        Unit quaternion (w, x, y, z) of the torsion-free frame.

    Raises
    ------
    TypeError, ValueError
        If `bending` is not real or its last axis is not 2.

    Examples
    --------
    >>> position, quaternion = segment_pose(np.array([np.pi / 2, 0.0]), 1.0)
    >>> position.round(6)  # a quarter circle of length 1 has the radius 2 / pi
    array([0.63662, 0.     , 0.63662])
    """
    bending = check_last_axis(bending, 2, "bending")
    xp = namespace(bending)
    length = parameter(length, bending)
    position, quaternion = arc_pose(bending[..., 0], bending[..., 1], length)
    return xp.stack(position, -1), xp.stack(quaternion, -1)


def segment_ends(bending: Array, lengths: Array) -> tuple[list[Array], list[Array]]:
    """Return the poses of all segments' ends in the base frame, base to tip.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vector of every segment [rad], each in the frame at its own base.
    lengths : array_like, shape (S,) or (..., S)
        Segment lengths [m].

    Returns
    -------
    positions : list of S arrays, shape (..., 3)
        [m].
    quaternions : list of S arrays, shape (..., 4)
        Unit quaternions (w, x, y, z).

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> positions, _ = segment_ends(np.zeros((2, 2)), [0.2, 0.1])
    >>> positions[1]
    array([0. , 0. , 0.3])
    """
    bending = check_pairs(bending, lengths, "bending")
    xp, lengths = namespace(bending), parameters(lengths, bending)
    poses = chain_poses(split_segments(bending), lengths)
    return [xp.stack(p, -1) for p, _ in poses], [xp.stack(q, -1) for _, q in poses]


def chain_poses(parts: Sequence[Number], lengths: Array) -> list[tuple[Components, Components]]:
    """Return the poses of all segments' ends, by components.

    Parameters
    ----------
    parts : sequence of 2S numbers
        Components x, y of each segment's bending vector [rad].
    lengths : sequence of S
        Segment lengths [m].

    Returns
    -------
    list of S (position, quaternion)
        In the base frame, base to tip.

    Examples
    --------
    >>> chain_poses([0.0, 0.0, 0.0, 0.0], [0.25, 0.5])[1][0]
    (0.0, 0.0, 0.75)
    """
    poses = [arc_pose(parts[0], parts[1], lengths[0])]
    for k in range(1, len(lengths)):
        position, quaternion = poses[-1]
        step, turn = arc_pose(parts[2 * k], parts[2 * k + 1], lengths[k])
        moved = turned(quaternion, step)
        position = tuple(a + b for a, b in zip(position, moved, strict=True))
        poses.append((position, product(quaternion, turn)))
    return poses


def forward(bending: Array, lengths: Array) -> tuple[Array, Array]:
    """Return the tip pose of segments in series.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    lengths : array_like, shape (S,)
        Segment lengths [m].

    Returns
    -------
    position : array, shape (..., 3)
        Tip position [m] in the base frame.
    quaternion : array, shape (..., 4)
        Tip orientation (w, x, y, z).

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> forward(np.zeros((1, 2)), [0.2])
    (array([0. , 0. , 0.2]), array([ 1., -0.,  0.,  0.]))
    """
    positions, quaternions = segment_ends(bending, lengths)
    return positions[-1], quaternions[-1]


def backbone(bending: Array, lengths: Array, points: int = 16) -> Array:
    """Return points along the backbone, base included, evenly spaced in each segment.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    lengths : array_like, shape (S,)
        Segment lengths [m].
    points : int
        Points a segment, its end included.

    Returns
    -------
    array, shape (..., S * points + 1, 3)
        Positions [m] in the base frame.

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> backbone(np.zeros((1, 2)), [0.2], points=2)[:, 2]
    array([0. , 0.1, 0.2])
    """
    bending = check_pairs(bending, lengths, "bending")
    xp, lengths = namespace(bending), parameters(lengths, bending)
    parts = split_segments(bending)
    planes = xp.stack(arc_planes(parts, chain_poses(parts, lengths), lengths))
    fractions = matrix_like(np.arange(1, points + 1) / points, bending)
    curves = chain_points(planes.reshape(len(planes), -1), fractions)
    return curves.reshape(*bending.shape[:-2], *curves.shape[1:])


def arc_planes(
    parts: Sequence[Number], poses: Sequence[tuple[Components, Components]], lengths: Array
) -> list[Number]:
    r"""Return the plane that each segment's arc lies in, and how far it bends there.

    At the fraction f of a segment, with :math:`h = \sin(f\phi/2)/(f\phi)`, the arc is at
    :math:`p + (fh)^2 b + fh\cos(f\phi/2)\,t` with :math:`b = 2l R(x, y, 0)` and
    :math:`t = 2l R(0, 0, 1)`, where R p is the frame that the segment begins in.

    Parameters
    ----------
    parts : sequence of 2S numbers
        Components x, y of each segment's bending vector [rad].
    poses : sequence of S (position, quaternion)
        Those of `chain_poses`.
    lengths : sequence of S
        Segment lengths [m].

    Returns
    -------
    list of length 10 S
        Of each segment :math:`\phi^2` [rad^2], and the coordinates of b, t and p [m].

    Examples
    --------
    >>> bends = [0.0, 0.0, 0.0, 0.0]
    >>> planes = arc_planes(bends, chain_poses(bends, [0.25, 0.5]), [0.25, 0.5])
    >>> planes[14:17], planes[17:]
    ([0.0, 0.0, 1.0], [0.0, 0.0, 0.25])
    """
    x, y, double = parts[0], parts[1], 2.0 * lengths[0]
    none = 0.0 * x
    told = [x * x + y * y, double * x, double * y, none, none, none, none + double]
    told += none, none, none
    for k in range(1, len(lengths)):
        x, y, double = parts[2 * k], parts[2 * k + 1], 2.0 * lengths[k]
        position, quaternion = poses[k - 1]
        rows, across, aside = rotation_rows(quaternion), double * x, double * y
        told.append(x * x + y * y)
        told += [a * across + b * aside for a, b, _ in rows]
        told += [double * c for _, _, c in rows]
        told += position
    return told


def chain_points(planes: Array, fractions: Array) -> Array:
    """Return points along the backbones of R robots.

    Parameters
    ----------
    planes : array, shape (10 S, R)
        What `arc_planes` tells.
    fractions : array, shape (P,)
        Where the points of each segment are along it.

    Returns
    -------
    array, shape (R, S * P + 1, 3)
        Positions [m] in the base frame, base first; a view of one with the robots last.

    Examples
    --------
    >>> planes = arc_planes([0.0, 0.0], chain_poses([0.0, 0.0], [0.25]), [0.25])
    >>> chain_points(np.array(planes)[:, None], np.array([0.5, 1.0]))[0, :, 2]
    array([0.   , 0.125, 0.25 ])
    """
    planes, fractions = planes.reshape(len(planes) // 10, 10, 1, -1), fractions[:, None]
    cosine, h = half_angle_functions(planes[:, 0] * (fractions * fractions))
    height = h * fractions
    curves = planes[:, 1:4] * (height * height)[:, None]
    curves += planes[:, 4:7] * (height * cosine)[:, None]
    curves += planes[:, 7:]
    return namespace(curves).concat([planes[0, 7:], *curves], 1).swapaxes(0, 2)
