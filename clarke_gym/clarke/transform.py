r"""The Clarke transform of n displacement-actuated joints arranged in a ring.

A segment with `n` joints at the angles :math:`\psi_i = 2\pi(i-1)/n` and one pitch radius has two
degrees of freedom. Its displacements lie on the two-dimensional manifold

.. math:: Q = \{\rho \in R^n : \rho_i = \rho_{Re}\cos\psi_i + \rho_{Im}\sin\psi_i\}

and :math:`(\rho_{Re}, \rho_{Im})` are its Clarke coordinates (Grassmann and Burgner-Kahrs, "Clarke
Transform and Clarke Coordinates"; the cheat sheet in its supplement is "the sheet" below).

Three lines of the printed sheet need care, and the tests hold the true statements:

* mode selection: :math:`M_P e_k = (2/n)(\cos\psi_k, \sin\psi_k)^T`; the sheet omits the 2/n;
* vanishing bias: :math:`M_P 1_n = 0` maps a vector of length n to one of length 2;
* :math:`\sum\rho_i = 0` alone does not define Q for n >= 4 (Q has codimension n - 2). The
  constraint is :math:`(I - P)\rho = 0`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from clarke_gym.numerics.arrays import Array, FloatArray, as_floating, matrix_like
from clarke_gym.numerics.checks import check_tendon_count


def _frozen(array: FloatArray) -> FloatArray:
    array.setflags(write=False)
    return array


@lru_cache(maxsize=256)
def joint_angles(n: int) -> FloatArray:
    r"""Return the symmetric joint angles :math:`\psi_i = 2\pi(i-1)/n`.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    ndarray, shape (n,)
        Angles [rad], read-only.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> np.degrees(joint_angles(4))
    array([  0.,  90., 180., 270.])
    """
    n = check_tendon_count(n)
    return _frozen(2.0 * np.pi * np.arange(n) / n)


@lru_cache(maxsize=256)
def transform_matrix(n: int) -> FloatArray:
    r"""Return the generalized Clarke transformation matrix :math:`M_P` (the sheet).

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    ndarray, shape (2, n)
        Read-only.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> transform_matrix(4).round(3) + 0.0
    array([[ 0.5,  0. , -0.5,  0. ],
           [ 0. ,  0.5,  0. , -0.5]])
    """
    return _frozen(2.0 / check_tendon_count(n) * inverse_matrix(n).T)


@lru_cache(maxsize=256)
def inverse_matrix(n: int) -> FloatArray:
    r"""Return the right inverse :math:`M_P^{-1} = (n/2) M_P^T` (the sheet).

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    ndarray, shape (n, 2)
        Read-only.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> np.allclose(transform_matrix(7) @ inverse_matrix(7), np.eye(2))
    True
    """
    psi = joint_angles(n)
    return _frozen(np.stack([np.cos(psi), np.sin(psi)], axis=1))


@lru_cache(maxsize=256)
def projector(n: int) -> FloatArray:
    r"""Return the orthogonal projector :math:`P = M_P^{-1}M_P` onto the manifold Q.

    It is the Toeplitz matrix :math:`P_{ij} = (2/n)\cos(2\pi(i-j)/n)` of rank 2 (the sheet).

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    ndarray, shape (n, n)
        Read-only.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> int(np.linalg.matrix_rank(projector(11)))
    2
    """
    return _frozen(inverse_matrix(n) @ transform_matrix(n))


def _joints(rho: Array) -> tuple[Array, int]:
    rho = as_floating(rho, "rho")
    if rho.ndim == 0:
        raise ValueError("rho must have a last axis of n >= 3 displacements, got a scalar")
    return rho, check_tendon_count(int(rho.shape[-1]), "the last axis of rho")


def to_clarke(rho: Array) -> Array:
    r"""Return the Clarke coordinates :math:`\bar\rho = M_P\rho`.

    Parameters
    ----------
    rho : array, shape (..., n)
        Joint displacements [m], > 0 when pulled.

    Returns
    -------
    array, shape (..., 2)
        :math:`(\rho_{Re}, \rho_{Im})` [m]. The part of `rho` off the manifold vanishes.

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real or its last axis is shorter than 3.

    Examples
    --------
    >>> to_clarke([0.003, -0.0015, -0.0015]).round(6) + 0.0
    array([0.003, 0.   ])
    """
    rho, n = _joints(rho)
    return rho @ matrix_like(transform_matrix(n).T, rho)


def from_clarke(rho_bar: Array, n: int) -> Array:
    r"""Return the joint displacements :math:`\rho = M_P^{-1}\bar\rho`.

    Parameters
    ----------
    rho_bar : array, shape (..., 2)
        Clarke coordinates [m].
    n : int
        Number of joints, at least 3.

    Returns
    -------
    array, shape (..., n)
        Displacements [m] on the manifold.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3, or the last axis of `rho_bar` is not 2.

    Examples
    --------
    >>> from_clarke([0.003, 0.0], 4).round(6) + 0.0
    array([ 0.003,  0.   , -0.003,  0.   ])
    """
    rho_bar = as_floating(rho_bar, "rho_bar")
    if rho_bar.ndim == 0 or rho_bar.shape[-1] != 2:
        raise ValueError(f"rho_bar must have a last axis of 2, got shape {tuple(rho_bar.shape)}")
    return rho_bar @ matrix_like(inverse_matrix(n).T, rho_bar)


def project(rho: Array) -> Array:
    r"""Return the nearest displacements on the manifold, :math:`P\rho`.

    Parameters
    ----------
    rho : array, shape (..., n)
        Joint displacements [m].

    Returns
    -------
    array, shape (..., n)
        Displacements [m]; ``rho - project(rho)`` is the off-manifold part.

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real or its last axis is shorter than 3.

    Examples
    --------
    >>> project([1.0, 1.0, 1.0]).round(12) + 0.0
    array([0., 0., 0.])
    """
    rho, n = _joints(rho)
    return rho @ matrix_like(projector(n), rho)


def layout_matrices(
    angles: Sequence[float] | FloatArray,
    radii: float | Sequence[float] | FloatArray,
    pitch_radius: float,
) -> tuple[FloatArray, FloatArray]:
    r"""Return encoder and decoder of joints at arbitrary angles and radii.

    With :math:`A = (d_i\cos\psi_i, d_i\sin\psi_i)` the displacements of a segment of bending vector
    :math:`\beta` are :math:`\rho = A\beta`. Clarke coordinates stay :math:`\bar\rho = d\,\beta`
    for one nominal radius d, so the decoder is :math:`D = A/d` and the encoder its least-squares
    left inverse. Equal radii and symmetric angles give :math:`M_P^{-1}` and :math:`M_P`.

    Parameters
    ----------
    angles : array_like, shape (n,)
        Joint angles [rad].
    radii : float or array_like, shape (n,)
        Distance of each joint from the backbone [m].
    pitch_radius : float
        Nominal radius d [m] that scales the Clarke coordinates.

    Returns
    -------
    encoder : ndarray, shape (2, n)
    decoder : ndarray, shape (n, 2)

    Raises
    ------
    ValueError
        If there are fewer than 3 joints, a radius is not positive and finite, or all joints lie on
        one line through the backbone, which leaves a direction that no joint can bend.

    Examples
    --------
    >>> encoder, decoder = layout_matrices(joint_angles(5), 0.01, 0.01)
    >>> np.allclose(encoder, transform_matrix(5)), np.allclose(decoder, inverse_matrix(5))
    (True, True)
    """
    psi = np.asarray(angles, dtype=np.float64)
    if psi.ndim != 1 or not np.isfinite(psi).all():
        raise ValueError(f"angles must be one row of finite numbers, got {angles!r}")
    check_tendon_count(psi.size, "the number of angles")
    d = np.asarray(radii, dtype=np.float64)
    if d.shape not in ((), psi.shape) or not (np.isfinite(d).all() and (d > 0.0).all()):
        raise ValueError(f"radii must be positive, one or {psi.size} numbers, got {radii!r}")
    if not (np.isfinite(pitch_radius) and pitch_radius > 0.0):
        raise ValueError(f"pitch_radius must be positive and finite, got {pitch_radius!r}")
    decoder = (d / pitch_radius * np.stack([np.cos(psi), np.sin(psi)])).T
    if np.linalg.cond(decoder) > 1e8:
        raise ValueError(f"the joints at angles {psi.tolist()} rad are collinear: no plane to bend")
    encoder = np.linalg.solve(decoder.T @ decoder, decoder.T)
    return encoder, decoder
