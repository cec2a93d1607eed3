"""Extensible segments in series: pass-through joints decode to bends and lengths."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from clarke_gym.clarke.layouts import Layout
from clarke_gym.numerics.arrays import Array, array_namespace, as_floating, parameter


def robot_to_extensible(
    rho: Array, layouts: Sequence[Layout], rest_lengths: Array
) -> tuple[Array, Array]:
    r"""Return bending vectors and lengths of extensible segments in series.

    Tendons of segment j pass through all segments before it with their own radii and angles, so
    their Clarke coordinates are :math:`d_j\sum_{k\le j}\beta_k` and their common mode the sum of
    the shortenings.

    Parameters
    ----------
    rho : array, shape (..., N)
        Displacements [m], segment by segment from the base.
    layouts : sequence of S Layout
    rest_lengths : array_like, shape (S,)
        [m].

    Returns
    -------
    bending : array, shape (..., S, 2)
        [rad].
    lengths : array, shape (..., S)
        [m].

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> ring = Layout.symmetric(3, 0.01)
    >>> bending, lengths = robot_to_extensible(np.full(6, -0.01), [ring, ring], [0.2, 0.1])
    >>> lengths.round(6)
    array([0.21, 0.1 ])
    """
    rho = _joints(rho, layouts)
    xp = array_namespace(rho)
    sums, starts = [], np.cumsum([0, *(layout.n for layout in layouts)])
    for k, layout in enumerate(layouts):
        clarke, shift = layout.to_extensible(rho[..., starts[k] : starts[k + 1]], 0.0)
        sums.append((clarke / layout.pitch_radius, shift))
    bending = [sums[0][0], *(b[0] - a[0] for a, b in pairwise(sums))]
    longer = [sums[0][1], *(b[1] - a[1] for a, b in pairwise(sums))]
    lengths = [parameter(rest, rho) + more for rest, more in zip(rest_lengths, longer, strict=True)]
    return xp.stack(bending, -2), xp.stack(lengths, -1)


def robot_from_extensible(
    bending: Array, lengths: Array, layouts: Sequence[Layout], rest_lengths: Array
) -> Array:
    """Return the displacements of extensible segments, the inverse of `robot_to_extensible`.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        [rad].
    lengths : array, shape (..., S)
        [m].
    layouts : sequence of S Layout
    rest_lengths : array_like, shape (S,)
        [m].

    Returns
    -------
    array, shape (..., N)
        [m].

    Raises
    ------
    TypeError, ValueError
        If the shapes do not fit.

    Examples
    --------
    >>> ring = Layout.symmetric(3, 0.01)
    >>> robot_from_extensible(np.zeros((2, 2)), np.array([0.21, 0.1]), [ring, ring], [0.2, 0.1])
    array([-0.01, -0.01, -0.01, -0.01, -0.01, -0.01])
    """
    bending, lengths = as_floating(bending, "bending"), as_floating(lengths, "lengths")
    count = len(layouts)
    if bending.shape[-2:] != (count, 2) or lengths.shape[-1:] != (count,):
        raise ValueError(
            f"bending and lengths must end in ({count}, 2) and ({count},), "
            f"got {tuple(bending.shape)} and {tuple(lengths.shape)}"
        )
    parts, turned, longer = [], 0.0, 0.0
    for k, layout in enumerate(layouts):
        turned = turned + bending[..., k, :]
        longer = longer + (lengths[..., k] - parameter(rest_lengths[k], lengths))
        parts.append(layout.from_extensible(layout.pitch_radius * turned, longer, 0.0))
    return array_namespace(bending).concat(parts, -1)


def _joints(rho: Array, layouts: Sequence[Layout]) -> Array:
    rho, count = as_floating(rho, "rho"), sum(layout.n for layout in layouts)
    if rho.ndim == 0 or rho.shape[-1] != count:
        raise ValueError(f"rho must have a last axis of {count}, got {tuple(rho.shape)}")
    return rho
