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
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clarke_gym._arrays import Array, FloatArray, FloatMath, Number, as_floating, namespace

_SERIES_TERMS = 10
_TINY_32 = np.finfo(np.float32).tiny
_TINY_64 = float(np.finfo(np.float64).tiny)

Components = tuple[Number, ...]
"""Coordinates of a vector or quaternion, each a float or an array."""


def half_angle_functions(squared_angle: Array) -> tuple[Array, Array]:
    r"""Return :math:`\cos(\phi/2)` and :math:`h = \sin(\phi/2)/\phi` from :math:`u = \phi^2`.

    Parameters
    ----------
    squared_angle : array
        u [rad^2], any shape.

    Returns
    -------
    cosine, h : array
        Shaped as `squared_angle`; at u = 0 they are 1 and 1/2.

    Examples
    --------
    >>> half_angle_functions(np.array([0.0, np.pi**2]))
    (array([1.000000e+00, 6.123234e-17]), array([0.5       , 0.31830989]))
    """
    xp = namespace(squared_angle)
    if xp is np or xp is FloatMath:
        half: Any = 0.5 * xp.sqrt(squared_angle)
        tiny = _TINY_32 if getattr(half, "dtype", None) == np.float32 else _TINY_64
        safe = xp.maximum(half, tiny)  # sin(t)/t is exactly 1 there
        return xp.cos(half), xp.sin(safe) / (2.0 * safe)
    # Autodiff through sqrt(u) is not finite at 0: below u = 1 use the Taylor series in u itself.
    near = squared_angle < 1.0
    small = xp.where(near, squared_angle, xp.zeros_like(squared_angle)) / 4.0
    cosine, sine = xp.ones_like(small), xp.ones_like(small)
    for k in range(_SERIES_TERMS, 0, -1):
        cosine = 1.0 - cosine * small / ((2 * k - 1) * (2 * k))
        sine = 1.0 - sine * small / ((2 * k) * (2 * k + 1))
    half = 0.5 * xp.sqrt(xp.where(near, xp.ones_like(squared_angle), squared_angle))
    return (
        xp.where(near, cosine, xp.cos(half)),
        xp.where(near, 0.5 * sine, xp.sin(half) / (2.0 * half)),
    )


def _check_bending(bending: Array) -> Array:
    bending = as_floating(bending, "bending")
    if bending.ndim == 0 or bending.shape[-1] != 2:
        raise ValueError(f"bending must have a last axis of 2, got shape {tuple(bending.shape)}")
    return bending


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
    bending = _check_bending(bending)
    xp = namespace(bending)
    position, quaternion = arc_pose(bending[..., 0], bending[..., 1], length)
    return xp.stack(position, -1), xp.stack(quaternion, -1)


def clarke_to_bending(clarke: Array, pitch_radii: Array) -> Array:
    """Return the segments' own bending vectors from the Clarke coordinates of their tendons.

    Tendons of a distal segment pass through the proximal ones, so that
    rho_bar_j = d_j (beta_1 + ... + beta_j) and beta_j = rho_bar_j / d_j - rho_bar_i / d_i, i = j-1.

    Parameters
    ----------
    clarke : array, shape (..., S, 2)
        Clarke coordinates of each segment's tendons [m].
    pitch_radii : array, shape (S,)
        Nominal pitch radii d_j [m].

    Returns
    -------
    array, shape (..., S, 2)
        Bending vectors [rad].

    Examples
    --------
    >>> clarke = np.array([[0.01, 0.0], [0.03, 0.0]])
    >>> clarke_to_bending(clarke, np.array([0.01, 0.01]))[:, 0]
    array([1., 2.])
    """
    xp = namespace(clarke)
    pairs = [_split(clarke[..., k, :]) for k in range(clarke.shape[-2])]
    return xp.stack([xp.stack(pair, -1) for pair in decoupled(pairs, pitch_radii)], -2)


def decoupled(pairs: Sequence[Components], pitch_radii: Array) -> list[Components]:
    """Do the same by components: S pairs in, S pairs out."""
    sums = [(x / d, y / d) for (x, y), d in zip(pairs, pitch_radii, strict=True)]
    if len(sums) == 1:
        return sums
    steps = zip(sums[1:], sums[:-1], strict=True)
    return [sums[0], *((x - a, y - b) for (x, y), (a, b) in steps)]


def bending_to_clarke(bending: Array, pitch_radii: Array) -> Array:
    """Return the Clarke coordinates of the segments' tendons from their bending vectors.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    pitch_radii : array, shape (S,)
        Nominal pitch radii d_j [m].

    Returns
    -------
    array, shape (..., S, 2)
        Clarke coordinates [m], the inverse of `clarke_to_bending`.

    Examples
    --------
    >>> bending_to_clarke(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([0.01, 0.01]))[:, 0]
    array([0.01, 0.03])
    """
    xp = namespace(bending)
    pairs = [_split(bending[..., k, :]) for k in range(bending.shape[-2])]
    return xp.stack([xp.stack(pair, -1) for pair in coupled(pairs, pitch_radii)], -2)


def coupled(pairs: Sequence[Components], pitch_radii: Array) -> list[Components]:
    """Do the same by components: S pairs in, S pairs out."""
    sums = [pairs[0]]
    for x, y in pairs[1:]:
        sums.append((sums[-1][0] + x, sums[-1][1] + y))
    return [(x * d, y * d) for (x, y), d in zip(sums, pitch_radii, strict=True)]


def quaternion_multiply(first: Array, second: Array) -> Array:
    """Return the Hamilton product of two arrays of quaternions (w, x, y, z).

    Parameters
    ----------
    first, second : array, shape (..., 4)

    Returns
    -------
    array, shape (..., 4)

    Examples
    --------
    >>> quaternion_multiply(np.array([0.0, 1, 0, 0]), np.array([0.0, 0, 1, 0]))
    array([0., 0., 0., 1.])
    """
    xp = namespace(first, second)
    return xp.stack(_product(_split(first), _split(second)), -1)


def _split(array: Array) -> Components:
    return tuple(array[..., i] for i in range(array.shape[-1]))


def _product(first: Components, second: Components) -> Components:
    a, b, c, d = first
    w, x, y, z = second
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def _turned(quaternion: Components, vector: Components) -> Components:
    w, a, b, c = quaternion
    x, y, z = vector
    tx, ty, tz = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return (
        x + w * tx + b * tz - c * ty,
        y + w * ty + c * tx - a * tz,
        z + w * tz + a * ty - b * tx,
    )


def rotate(quaternion: Array, vector: Array) -> Array:
    """Return `vector` turned by unit quaternions (w, x, y, z).

    Parameters
    ----------
    quaternion : array, shape (..., 4)
    vector : array, shape (..., 3)

    Returns
    -------
    array, shape (..., 3)

    Examples
    --------
    >>> quarter_turn_about_z = np.sqrt([0.5, 0.0, 0.0, 0.5])
    >>> rotate(quarter_turn_about_z, np.array([1.0, 0.0, 0.0])).round(12) + 0.0
    array([0., 1., 0.])
    """
    xp = namespace(quaternion, vector)
    return xp.stack(_turned(_split(quaternion), _split(vector)), -1)


def _check_segments(bending: Array, lengths: Array) -> tuple[Array, Array]:
    bending = _check_bending(bending)
    if bending.ndim < 2 or bending.shape[-2] != len(lengths):
        raise ValueError(
            f"bending must have the shape (..., {len(lengths)}, 2) for {len(lengths)} lengths, "
            f"got {tuple(bending.shape)}"
        )
    return bending, lengths


def segment_ends(bending: Array, lengths: Array) -> tuple[list[Array], list[Array]]:
    """Return the poses of all segments' ends in the base frame, base to tip.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vector of every segment [rad], each in the frame at its own base.
    lengths : array_like, shape (S,)
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
    bending, lengths = _check_segments(bending, lengths)
    xp = namespace(bending)
    pairs = [_split(bending[..., k, :]) for k in range(len(lengths))]
    poses = chain_poses(pairs, lengths)
    return [xp.stack(p, -1) for p, _ in poses], [xp.stack(q, -1) for _, q in poses]


def chain_poses(pairs: Sequence[Components], lengths: Array) -> list[tuple[Components, Components]]:
    """Return the poses of all segments' ends, by components.

    Parameters
    ----------
    pairs : sequence of S pairs
        Components (x, y) of each segment's bending vector [rad].
    lengths : sequence of S
        Segment lengths [m].

    Returns
    -------
    list of S (position, quaternion)
        In the base frame, base to tip.

    Examples
    --------
    >>> chain_poses([(0.0, 0.0), (0.0, 0.0)], [0.25, 0.5])[1][0]
    (0.0, 0.0, 0.75)
    """
    poses = [arc_pose(pairs[0][0], pairs[0][1], lengths[0])]
    for k in range(1, len(lengths)):
        position, quaternion = poses[-1]
        step, turn = arc_pose(pairs[k][0], pairs[k][1], lengths[k])
        moved = _turned(quaternion, step)
        position = tuple(a + b for a, b in zip(position, moved, strict=True))
        poses.append((position, _product(quaternion, turn)))
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
    bending, lengths = _check_segments(bending, lengths)
    xp = namespace(bending)
    positions, quaternions = segment_ends(bending, lengths)
    fractions = xp.arange(1, points + 1) / points
    curves = [xp.zeros_like(positions[0])[..., None, :]]
    for k in range(len(lengths)):
        part = bending[..., k, None, :] * fractions[:, None]
        local, _ = segment_pose(part, lengths[k] * fractions)
        if k:
            local = positions[k - 1][..., None, :] + rotate(quaternions[k - 1][..., None, :], local)
        curves.append(local)
    return xp.concat(curves, -2)


def dome_density(bending_angle: ArrayLike) -> FloatArray:
    r"""Return the tip-surface area per unit of bending angle and of direction, over l^2.

    The tips of a segment of fixed length form a dome; its area element is
    :math:`r(\phi)\,|dp/d\phi|\,d\phi\,d\theta` with the tip's radius r.

    Parameters
    ----------
    bending_angle : array_like
        phi [rad] in [0, 2 pi).

    Returns
    -------
    ndarray
        Area density, shaped as `bending_angle`.

    Examples
    --------
    >>> angle = np.array([1e-6])
    >>> dome_density(angle) / angle  # a flat disk of radius l phi / 2 near the top
    array([0.25])
    """
    phi = np.asarray(bending_angle, dtype=np.float64)
    cosine, h = half_angle_functions(phi * phi)
    radius = 2.0 * phi * h * h
    # |dp/dphi|^2 = (dr/dphi)^2 + (dz/dphi)^2 in terms of S = sin(phi)/phi and h.
    s = 2.0 * h * cosine
    small = phi < 1e-3
    safe = np.where(small, 1.0, phi)
    radial = s - 2.0 * h * h
    axial = np.where(small, -phi / 3.0, (np.cos(safe) - s) / safe)
    return radius * np.hypot(radial, axial)


@lru_cache(maxsize=1)
def _dome_table() -> tuple[FloatArray, FloatArray]:
    """Bending angles and the dome's area up to them (per radian of direction, over l^2)."""
    angles = np.linspace(0.0, 2.0 * np.pi, 4097)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    step = angles[1]
    samples = angles[:-1, None] + step * (nodes + 1.0) / 2.0
    areas = dome_density(samples) @ weights * step / 2.0
    return angles, np.concatenate([[0.0], np.cumsum(areas)])


def sample_dome(uniforms: NDArray[np.float64], max_bending: ArrayLike) -> FloatArray:
    """Return bending vectors whose tip positions are uniform over the dome of one segment.

    Uniform Clarke coordinates would crowd the dome's rim: there the same step in bending moves the
    tip less. The area is inverted instead.

    Parameters
    ----------
    uniforms : ndarray, shape (..., 2)
        Independent uniform numbers in [0, 1).
    max_bending : array_like, shape (...)
        Bending limit [rad], at most 2 pi.

    Returns
    -------
    ndarray, shape (..., 2)
        Bending vectors [rad].

    Examples
    --------
    >>> sample_dome(np.array([[0.0, 0.0], [1.0, 0.25]]), 1.5).round(6) + 0.0
    array([[0. , 0. ],
           [0. , 1.5]])
    """
    angles, areas = _dome_table()
    total = np.interp(np.asarray(max_bending, dtype=np.float64), angles, areas)
    phi = np.interp(uniforms[..., 0] * total, areas, angles)
    theta = 2.0 * np.pi * uniforms[..., 1]
    return np.stack([phi * np.cos(theta), phi * np.sin(theta)], axis=-1)
