"""The dome of tip positions of one segment of fixed length: its area, and uniform samples."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from clarke_gym.kinematics.arcs import half_angle_functions
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, matrix_like
from clarke_gym.numerics.checks import check_positive


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


def sample_dome(uniforms: Array, max_bending: ArrayLike) -> Array:
    """Return bending vectors whose tip positions are uniform over the dome of one segment.

    Uniform Clarke coordinates would crowd the dome's rim: there the same step in bending moves the
    tip less. The area is inverted instead.

    Parameters
    ----------
    uniforms : array, shape (..., 2)
        Independent uniform numbers in [0, 1).
    max_bending : array_like, shape (...)
        Bending limit [rad], at most 2 pi.

    Returns
    -------
    array, shape (..., 2)
        Bending vectors [rad].

    Examples
    --------
    >>> sample_dome(np.array([[0.0, 0.0], [1.0, 0.25]]), 1.5).round(6) + 0.0
    array([[0. , 0. ],
           [0. , 1.5]])
    """
    xp, (angles, areas) = array_namespace(uniforms), _dome_table()
    total = np.interp(np.asarray(max_bending, dtype=np.float64), angles, areas)
    if xp is np:
        uniforms = np.asarray(uniforms)
        phi = np.interp(uniforms[..., 0] * total, areas, angles).astype(uniforms.dtype)
    else:
        area = uniforms[..., 0] * matrix_like(total, uniforms)
        below = np.searchsorted(areas[1:-1], area.detach().cpu().numpy(), side="right")
        low, high = (matrix_like(areas[below + k], uniforms) for k in (0, 1))
        first, last = (matrix_like(angles[below + k], uniforms) for k in (0, 1))
        phi = first + (area - low) / (high - low) * (last - first)
    theta = 2.0 * math.pi * uniforms[..., 1]
    return xp.stack([phi * xp.cos(theta), phi * xp.sin(theta)], -1)


def sample_tips(uniforms: Array, max_bending: float, pitch_radius: float) -> Array:
    """Return Clarke coordinates whose tip positions are uniform over the dome of one segment.

    Parameters
    ----------
    uniforms : array, shape (..., 2)
        Independent uniform numbers in [0, 1).
    max_bending : float
        Bending limit [rad], at most 2 pi.
    pitch_radius : float
        d [m].

    Returns
    -------
    array, shape (..., 2)
        [m].

    Raises
    ------
    ValueError
        If `pitch_radius` is not positive.

    Examples
    --------
    >>> import numpy as np
    >>> sample_tips(np.array([[1.0, 0.0]]), 1.5, 0.01)
    array([[0.015, 0.   ]])
    """
    return check_positive("pitch_radius", pitch_radius) * sample_dome(uniforms, max_bending)
