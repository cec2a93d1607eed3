r"""Limits of the joints mapped to the manifold and back.

With equal pitch radii :math:`|\rho_i| \le |\bar\rho|`, and likewise for every derivative in time.
So the inscribed circle :math:`|\bar\rho| \le r` is enough for joint limits r; the exact image of
the box :math:`|\rho_i| \le r` is a regular polygon around it, with m = n (n even) or 2n (n odd)
corners.
"""

from __future__ import annotations

import math

import numpy as np

from clarke_gym.clarke.layouts import Layout
from clarke_gym.clarke.transform import from_clarke
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, as_floating
from clarke_gym.numerics.batch import shortened
from clarke_gym.numerics.checks import check_last_axis, check_positive, check_tendon_count


def polygon_corners(n: int) -> int:
    """Return how many corners the image of the joint box has: n if n is even, else 2 n.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    int

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> polygon_corners(3), polygon_corners(4)
    (6, 4)
    """
    n = check_tendon_count(n)
    return n if n % 2 == 0 else 2 * n


def circumradius_ratio(n: int) -> float:
    r"""Return the polygon's circumradius over the inscribed radius, :math:`1/\cos(\pi/m)`.

    It is the largest :math:`|\bar\rho|` that some direction allows, over the joint limit.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    float

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> [round(circumradius_ratio(n), 3) for n in (3, 4, 5, 7, 11)]
    [1.155, 1.414, 1.051, 1.026, 1.01]
    """
    return 1.0 / math.cos(math.pi / polygon_corners(n))


def limit_polygon(n: int, joint_limit: float) -> FloatArray:
    r"""Return the corners of the set of Clarke coordinates with :math:`|\rho_i| \le r`.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.
    joint_limit : float
        r [m], or of a rate [m/s] and so on.

    Returns
    -------
    ndarray, shape (m, 2)
        Counter-clockwise.

    Raises
    ------
    TypeError, ValueError
        If `n` or `joint_limit` is impossible.

    Examples
    --------
    >>> limit_polygon(4, 1.0).round(6)
    array([[ 1.,  1.],
           [-1.,  1.],
           [-1., -1.],
           [ 1., -1.]])
    """
    m = polygon_corners(n)
    angle = math.pi / m * (2.0 * np.arange(m) + 1.0)
    radius = check_positive("joint_limit", joint_limit) * circumradius_ratio(n)
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def largest_joint(rho_bar: Array, n: int) -> Array:
    r"""Return :math:`\max_i|\rho_i|` of Clarke coordinates: the polygon's own norm.

    Parameters
    ----------
    rho_bar : array, shape (..., 2)
        [m], or their derivatives.
    n : int
        Number of joints, at least 3.

    Returns
    -------
    array, shape (...)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `rho_bar` is not real, its last axis is not 2, or `n` is impossible.

    Examples
    --------
    >>> largest_joint(np.array([0.0, 1.0]), 3).round(4)  # no joint at 90 degrees
    np.float64(0.866)
    """
    xp = array_namespace(as_floating(rho_bar, "rho_bar"))
    return xp.amax(abs(from_clarke(rho_bar, n)), -1)


def saturate_circle(rho_bar: Array, limit: float) -> Array:
    """Return Clarke coordinates shortened to at most `limit`: safe for every number of joints.

    Parameters
    ----------
    rho_bar : array, shape (..., 2)
        [m], or their derivatives.
    limit : float
        Joint limit, in the same unit.

    Returns
    -------
    array, shape (..., 2)

    Raises
    ------
    TypeError, ValueError
        If `rho_bar` is not real, its last axis is not 2, or `limit` is not positive.

    Examples
    --------
    >>> saturate_circle(np.array([3.0, 4.0]), 1.0)
    array([0.6, 0.8])
    """
    rho_bar = check_last_axis(rho_bar, 2, "rho_bar")
    pair = shortened(rho_bar[..., 0], rho_bar[..., 1], check_positive("limit", limit))
    return array_namespace(rho_bar).stack(pair, -1)


def saturate_polygon(rho_bar: Array, n: int, limit: float) -> Array:
    """Return Clarke coordinates shortened until every joint keeps its limit: nothing given away.

    Parameters
    ----------
    rho_bar : array, shape (..., 2)
        [m], or their derivatives.
    n : int
        Number of joints, at least 3.
    limit : float
        Joint limit, in the same unit.

    Returns
    -------
    array, shape (..., 2)

    Raises
    ------
    TypeError, ValueError
        If `rho_bar` is not real, its last axis is not 2, or a number is impossible.

    Examples
    --------
    >>> saturate_polygon(np.array([3.0, 3.0]), 4, 1.0)
    array([1., 1.])
    """
    rho_bar = check_last_axis(rho_bar, 2, "rho_bar")
    xp, largest = array_namespace(rho_bar), largest_joint(rho_bar, n)[..., None]
    outside = largest > check_positive("limit", limit)
    one = xp.ones_like(largest)
    return rho_bar * xp.where(outside, limit / xp.where(outside, largest, one), one)


def manifold_limit(joint_limits: Array, layout: Layout | None = None) -> float:
    r"""Return the radius of the largest disk of Clarke coordinates inside given joint limits.

    Joint i of radius d_i sees :math:`|\rho_i| \le (d_i/d)|\bar\rho|`, with equality in its own
    direction, so the radius is :math:`\min_i r_i d/d_i`.

    Parameters
    ----------
    joint_limits : array_like, shape (n,)
        Limits r_i of the displacements' magnitudes [m], or of a derivative.
    layout : Layout, optional
        Where the joints sit; the symmetric ring of equal radii by default.

    Returns
    -------
    float
        In the unit of the limits.

    Raises
    ------
    ValueError
        If a limit is not positive or their number does not fit.

    Examples
    --------
    >>> manifold_limit([0.01, 0.012, 0.011])
    0.01
    """
    limits = np.asarray(joint_limits, np.float64)
    check_tendon_count(limits.size, "the number of joint limits")
    if layout is not None:
        if limits.shape != (layout.n,):
            raise ValueError(f"joint_limits must hold {layout.n} numbers, got {limits.shape}")
        limits = limits * layout.pitch_radius / layout.radii
    return check_positive("the smallest joint limit", float(limits.min()))


def joint_limits(manifold_limit: float, layout: Layout) -> FloatArray:
    """Return the largest displacement of each joint over a disk of Clarke coordinates.

    Parameters
    ----------
    manifold_limit : float
        Radius of the disk [m], or of a derivative's disk.
    layout : Layout

    Returns
    -------
    ndarray, shape (n,)
        In the same unit.

    Raises
    ------
    ValueError
        If the radius is not positive.

    Examples
    --------
    >>> joint_limits(0.01, Layout.symmetric(3, 0.005))
    array([0.01, 0.01, 0.01])
    """
    return check_positive("manifold_limit", manifold_limit) * layout.radii / layout.pitch_radius
