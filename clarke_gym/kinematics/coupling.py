"""Coupling of segments in series: distal tendons pass through the proximal segments."""

from __future__ import annotations

from collections.abc import Sequence

from clarke_gym.kinematics.quaternions import split_segments
from clarke_gym.numerics.arrays import Array, Number, namespace, parameters
from clarke_gym.numerics.checks import check_pairs


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
    >>> import numpy as np
    >>> clarke = np.array([[0.01, 0.0], [0.03, 0.0]])
    >>> clarke_to_bending(clarke, np.array([0.01, 0.01]))[:, 0]
    array([1., 2.])
    """
    clarke = check_pairs(clarke, pitch_radii, "clarke")
    xp, radii = namespace(clarke), parameters(pitch_radii, clarke)
    return xp.stack(decoupled(split_segments(clarke), radii), -1).reshape(clarke.shape)


def decoupled(parts: Sequence[Number], pitch_radii: Array) -> list[Number]:
    """Do what `clarke_to_bending` does, by components.

    Parameters
    ----------
    parts : sequence of 2S numbers
        Components x, y of the Clarke coordinates of each segment's tendons [m]: floats or arrays.
    pitch_radii : sequence of S
        Nominal pitch radii d_j [m].

    Returns
    -------
    list of 2S numbers
        Components of the bending vectors [rad].

    Examples
    --------
    >>> decoupled([0.5, 0.0, 1.5, 0.0], [0.5, 0.5])
    [1.0, 0.0, 2.0, 0.0]
    """
    a, b = parts[0] / pitch_radii[0], parts[1] / pitch_radii[0]
    bends = [a, b]
    for k in range(1, len(pitch_radii)):
        x, y = parts[2 * k] / pitch_radii[k], parts[2 * k + 1] / pitch_radii[k]
        bends += x - a, y - b
        a, b = x, y
    return bends


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
    >>> import numpy as np
    >>> bending_to_clarke(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([0.01, 0.01]))[:, 0]
    array([0.01, 0.03])
    """
    bending = check_pairs(bending, pitch_radii, "bending")
    xp, radii = namespace(bending), parameters(pitch_radii, bending)
    return xp.stack(coupled(split_segments(bending), radii), -1).reshape(bending.shape)


def coupled(parts: Sequence[Number], pitch_radii: Array) -> list[Number]:
    """Do what `bending_to_clarke` does, by components.

    Parameters
    ----------
    parts : sequence of 2S numbers
        Components x, y of the bending vectors of the segments [rad]: floats or arrays.
    pitch_radii : sequence of S
        Nominal pitch radii d_j [m].

    Returns
    -------
    list of 2S numbers
        Components of the Clarke coordinates of their tendons [m].

    Examples
    --------
    >>> coupled([1.0, 0.0, 2.0, 0.0], [0.5, 0.5])
    [0.5, 0.0, 1.5, 0.0]
    """
    a, b = parts[0], parts[1]
    result = [a * pitch_radii[0], b * pitch_radii[0]]
    for k in range(1, len(pitch_radii)):
        a, b = a + parts[2 * k], b + parts[2 * k + 1]
        result += a * pitch_radii[k], b * pitch_radii[k]
    return result
