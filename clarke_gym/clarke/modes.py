r"""All spatial modes of a ring of joints: what lies off the manifold, by name.

The real Fourier basis splits :math:`R^n` into the common mode, the Clarke pair, and higher modes
that go :math:`m = 2, 3, \dots` times around the ring; for even n the last is the alternating mode.
Only the Clarke pair bends a segment with taut tendons, only the common mode changes its length;
every other mode just tightens tendons against each other.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from clarke_gym.clarke.transform import joint_angles
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, as_floating, matrix_like
from clarke_gym.numerics.checks import check_tendon_count


@lru_cache(maxsize=256)
def mode_names(n: int) -> tuple[str, ...]:
    """Return the names of the n modes in the order of `mode_matrix`.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    tuple of str

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> mode_names(6)
    ('common', 'clarke_re', 'clarke_im', 'mode_2_re', 'mode_2_im', 'alternating')
    """
    n = check_tendon_count(n)
    names = ["common", "clarke_re", "clarke_im"]
    for m in range(2, (n - 1) // 2 + 1):
        names += [f"mode_{m}_re", f"mode_{m}_im"]
    return (*names, "alternating") if n % 2 == 0 else tuple(names)


@lru_cache(maxsize=256)
def mode_matrix(n: int) -> FloatArray:
    r"""Return the modal transform: rows map displacements to the amplitudes of the modes.

    Rows of the common and the alternating mode are scaled by 1/n, of all pairs by 2/n, so rows 1
    and 2 are :math:`M_P` and every amplitude is in metres of displacement.

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
    >>> from clarke_gym.clarke.transform import transform_matrix
    >>> np.array_equal(mode_matrix(7)[1:3], transform_matrix(7))
    True
    """
    columns = mode_basis(n)
    single = np.array([not name.endswith(("_re", "_im")) for name in mode_names(n)])
    matrix = np.where(single, 1.0, 2.0)[:, None] / n * columns.T
    matrix.setflags(write=False)
    return matrix


@lru_cache(maxsize=256)
def mode_basis(n: int) -> FloatArray:
    """Return the inverse of `mode_matrix`: columns are the shapes of the modes around the ring.

    Parameters
    ----------
    n : int
        Number of joints, at least 3.

    Returns
    -------
    ndarray, shape (n, n)
        Read-only, with orthogonal columns.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> mode_basis(4)[:, 3]  # the alternating mode
    array([ 1., -1.,  1., -1.])
    """
    psi = joint_angles(n)
    columns = [np.ones(n)]
    for m in range(1, (n - 1) // 2 + 1):
        # Angles reduced to one turn first: cos(m psi) of a large m psi would lose digits.
        around = psi if m == 1 else joint_angles(n)[(m * np.arange(n)) % n]
        columns += [np.cos(around), np.sin(around)]
    if n % 2 == 0:
        columns.append(np.where(np.arange(n) % 2 == 0, 1.0, -1.0))
    basis = np.stack(columns, axis=1)
    basis.setflags(write=False)
    return basis


def to_modes(rho: Array) -> Array:
    """Return the amplitudes of all modes of displacements.

    Parameters
    ----------
    rho : array, shape (..., n)
        Displacements [m].

    Returns
    -------
    array, shape (..., n)
        Amplitudes [m] in the order of `mode_names`.

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real or its last axis is shorter than 3.

    Examples
    --------
    >>> to_modes(np.array([1.0, 1.0, 1.0, 1.0])).round(12) + 0.0
    array([1., 0., 0., 0.])
    """
    rho = _ring(rho, "rho")
    return rho @ matrix_like(mode_matrix(int(rho.shape[-1])).T, rho)


def from_modes(amplitudes: Array) -> Array:
    """Return the displacements of mode amplitudes, the inverse of `to_modes`.

    Parameters
    ----------
    amplitudes : array, shape (..., n)
        [m].

    Returns
    -------
    array, shape (..., n)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `amplitudes` is not real or its last axis is shorter than 3.

    Examples
    --------
    >>> from_modes(np.array([0.0, 1.0, 0.0]))
    array([ 1. , -0.5, -0.5])
    """
    amplitudes = _ring(amplitudes, "amplitudes")
    return amplitudes @ matrix_like(mode_basis(int(amplitudes.shape[-1])).T, amplitudes)


def _ring(array: Array, name: str) -> Array:
    array = as_floating(array, name)
    if array.ndim == 0:
        raise ValueError(f"{name} must have a last axis of n >= 3 joints, got a scalar")
    check_tendon_count(int(array.shape[-1]), f"the last axis of {name}")
    return array


def mode_energy(rho: Array) -> dict[str, Array]:
    r"""Return how much of :math:`|\rho|^2` each mode holds, pairs together.

    Parameters
    ----------
    rho : array, shape (..., n)
        Displacements [m].

    Returns
    -------
    dict of str to array, shape (...)
        ``common``, ``clarke``, ``mode_2`` ...; they sum to :math:`|\rho|^2` [m^2].

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real or its last axis is shorter than 3.

    Examples
    --------
    >>> {name: float(e.round(3)) for name, e in mode_energy(np.array([1.0, 0, 0, 0, 0])).items()}
    {'common': 0.2, 'clarke': 0.4, 'mode_2': 0.4}
    """
    amplitudes = to_modes(rho)
    n = int(amplitudes.shape[-1])
    energy: dict[str, Array] = {}
    for k, name in enumerate(mode_names(n)):
        pair = name.endswith(("_re", "_im"))
        key = name[:-3] if pair else name
        part = (0.5 * n if pair else float(n)) * amplitudes[..., k] ** 2
        energy[key] = energy[key] + part if key in energy else part
    return energy


def normalised(rho: Array, epsilon: float = 0.0) -> Array:
    r"""Return displacements over their magnitude, :math:`\rho/(\sqrt{\rho^T\rho} + \epsilon)`.

    The sheet's normalised displacement-actuated joints; a small epsilon > 0 keeps it finite, and
    its gradient too, at rho = 0.

    Parameters
    ----------
    rho : array, shape (..., n)
        Displacements [m], or Clarke coordinates.
    epsilon : float
        Added to the magnitude [m], with epsilon^2 negligible.

    Returns
    -------
    array, shape (..., n)
        Dimensionless.

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real, `epsilon` is negative, or rho = 0 while epsilon = 0.

    Examples
    --------
    >>> normalised(np.array([0.03, -0.04]))
    array([ 0.6, -0.8])
    """
    rho = as_floating(rho, "rho")
    if not epsilon >= 0.0:
        raise ValueError(f"epsilon must be >= 0, got {epsilon!r}")
    xp = array_namespace(rho)
    square = (rho * rho).sum(-1)
    zero = square == 0.0
    if epsilon == 0.0 and bool(zero.any()):
        raise ValueError("rho = 0 has no direction; give an epsilon > 0")
    magnitude = xp.where(zero, 0.0 * square, xp.sqrt(xp.where(zero, xp.ones_like(square), square)))
    return rho / (magnitude + epsilon)[..., None]
