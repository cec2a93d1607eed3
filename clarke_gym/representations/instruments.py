"""Representations that nobody would use: each takes one cause of a difference between arms apart.

==================  ====  ==================================================================
name                k     coordinates of one segment with n tendons
==================  ====  ==================================================================
``modal``           n     raw in the orthonormal Fourier basis of its tendons: the manifold's
                          two axes first, then what lies off it; isotropic noise is raw's
``clarke_nuisance`` n     Clarke coordinates and n - 2 numbers that do nothing
==================  ====  ==================================================================
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.robots.robot import Segment


def modal(segment: Segment) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return raw tendon space turned so that two axes span the manifold.

    Parameters
    ----------
    segment : Segment
        With n tendons.

    Returns
    -------
    decoder, encoder : ndarray, shape (n, n)
        An orthogonal matrix and its transpose: on an evenly spaced ring the Fourier modes, of
        frequency 1, 0, 2, 3, ...; else an orthonormal basis that begins with the manifold's.

    Examples
    --------
    >>> decoder, encoder = modal(Segment(n_tendons=5))
    >>> np.allclose(encoder @ decoder, np.eye(5))
    True
    """
    n = segment.n_tendons
    harmonics = [
        part(k * segment.angles) for k in range(1, n // 2 + 1) for part in (np.cos, np.sin)
    ]
    # Of the manifold first; QR keeps the order, and drops what a ring of n cannot tell apart.
    columns = np.column_stack([segment.matrices[1], np.ones(n), *harmonics[2:], np.eye(n)])
    basis = _orthonormal(columns, n)
    return basis, basis.T


def _orthonormal(columns: NDArray[Any], n: int) -> NDArray[Any]:
    """Return n orthonormal columns that span the given ones from left to right."""
    basis: list[NDArray[Any]] = []
    for column in columns.T:
        rest = column / np.linalg.norm(column) if column.any() else column
        for _ in range(2):  # once more for rounding
            for axis in basis:
                rest = rest - (axis @ rest) * axis
        length = np.linalg.norm(rest)
        if length > 1e-6:
            basis.append(rest / length)
        if len(basis) == n:
            break
    return np.column_stack(basis)


def clarke_nuisance(segment: Segment) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return Clarke coordinates followed by n - 2 numbers without effect, seen as zeros.

    Parameters
    ----------
    segment : Segment
        With n tendons.

    Returns
    -------
    decoder, encoder : ndarray, shape (n, n)

    Examples
    --------
    >>> decoder, encoder = clarke_nuisance(Segment(n_tendons=5))
    >>> (decoder @ np.array([0.0, 0.0, 1.0, 1.0, 1.0])).tolist()
    [0.0, 0.0, 0.0, 0.0, 0.0]
    """
    encoder, decoder = segment.matrices
    nothing = np.zeros((segment.n_tendons, segment.n_tendons - 2))
    return np.hstack([decoder, nothing]), np.vstack([encoder, nothing.T])


INSTRUMENTS = {"modal": modal, "clarke_nuisance": clarke_nuisance}
"""The functions of this module by the names of their representations."""
