r"""The functions of the bending angle that arcs need, accurate down to zero curvature.

With u = phi^2 both :math:`\cos(\phi/2)` and :math:`h = \sin(\phi/2)/\phi` are smooth in u, so
poses, Jacobians and gradients built from them have no singularity at the straight robot.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from clarke_gym.numerics.arrays import Array, FloatMath, array_namespace, namespace

_SERIES_TERMS = 10
_ARCSINE = (1.0, 1 / 6, 3 / 40, 15 / 336, 105 / 3456, 945 / 42240, 10395 / 599040)
"""asin(s)/s in powers of s^2."""

_TINY_32 = np.finfo(np.float32).tiny
_TINY_64 = float(np.finfo(np.float64).tiny)


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


def half_angle_slope(squared_angle: Array, cosine: Array, h: Array) -> Array:
    r"""Return :math:`dh/du` of :math:`h = \sin(\phi/2)/\phi` with :math:`u = \phi^2`.

    Closed form :math:`(\cos(\phi/2)/2 - h)/(2u)` from u = 1 on, Taylor series in u below. The other
    derivative is :math:`d\cos(\phi/2)/du = -h/4`.

    Parameters
    ----------
    squared_angle : array
        u [rad^2], any shape.
    cosine, h : array
        The values of `half_angle_functions` there.

    Returns
    -------
    array
        Shaped as `squared_angle`; -1/48 at u = 0.

    Examples
    --------
    >>> u = np.array([0.0, 4.0])
    >>> (half_angle_slope(u, *half_angle_functions(u)) * 48).round(4)
    array([-1.    , -0.9035])
    """
    xp = array_namespace(squared_angle)
    near = squared_angle < 1.0
    safe = xp.where(near, xp.ones_like(squared_angle), squared_angle)
    small = xp.where(near, squared_angle, xp.zeros_like(squared_angle)) / 4.0
    # h = sum (-u/4)^k / (2 (2k+1)!), so dh/du = -1/8 sum (k+1) (-u/4)^k / (2k+3)!
    series = xp.ones_like(small)
    for k in range(_SERIES_TERMS, 0, -1):
        series = 1.0 - series * small * ((k + 1) / (k * (2 * k + 2) * (2 * k + 3)))
    return xp.where(near, series / -48.0, (0.5 * cosine - h) / (2.0 * safe))


def angle_over_sine(lateral: Array, axial: Array, square: Array) -> Array:
    r"""Return :math:`t/\sin t` of the angle t between a vector and an axis, smooth at t = 0.

    Parameters
    ----------
    lateral : array
        Square of the vector's part across the axis.
    axial : array
        Its part along the axis; t lies in [0, pi).
    square : array
        Square of the whole vector.

    Returns
    -------
    array
        Shaped as `lateral`.

    Examples
    --------
    >>> angle_over_sine(np.array([0.0, 1.0]), np.array([2.0, 0.0]), np.array([4.0, 1.0]))
    array([1.        , 1.57079633])
    """
    xp = array_namespace(lateral)
    ratio = lateral / square
    near = (ratio < 1e-3) & (axial > 0.0)
    small = xp.where(near, ratio, xp.zeros_like(ratio))
    series = xp.zeros_like(ratio)
    for coefficient in reversed(_ARCSINE):
        series = series * small + coefficient
    # Roots have no finite gradient at 0: the branch that is not used gets 1.
    radius = xp.sqrt(xp.where(near, xp.ones_like(lateral), lateral))
    size = xp.sqrt(xp.where(near, xp.ones_like(square), square))
    return xp.where(near, series, xp.arctan2(radius, axial) * size / radius)
