r"""Distribution of a manifold force over tendons that can only pull.

Tensions with the Clarke coordinates :math:`\bar\tau` are :math:`M_P^{-1}\bar\tau` plus any part
off the manifold. Half of :math:`M_P^{-1}\bar\tau` is negative, which a tendon cannot carry.
Clipping and shifting are named in Muhmann, Grassmann, Bartholdt and Burgner-Kahrs, "Toward Dynamic
Control of Tendon-Driven Continuum Robots using Clarke Transform", arXiv 2503.20693 (formulas not
read; derived here): shifting leaves the manifold force alone, clipping does not.
"""

from __future__ import annotations

from clarke_gym.clarke.transform import from_clarke
from clarke_gym.numerics.arrays import Array, array_namespace, as_floating


def clip(tension: Array, minimum_n: float = 0.0) -> Array:
    """Return tensions raised to a minimum, one by one: simple, but it changes the manifold force.

    Parameters
    ----------
    tension : array, shape (..., n)
        [N].
    minimum_n : float
        Smallest tension allowed [N].

    Returns
    -------
    array, shape (..., n)
        [N].

    Raises
    ------
    TypeError
        If `tension` is not real.

    Examples
    --------
    >>> import numpy as np
    >>> clip(np.array([2.0, -1.0, -1.0]))
    array([2., 0., 0.])
    """
    tension = as_floating(tension, "tension")
    return array_namespace(tension).where(tension < minimum_n, minimum_n + 0.0 * tension, tension)


def shift(tension: Array, minimum_n: float = 0.0, *, always: bool = False) -> Array:
    r"""Return tensions shifted by their common mode until the smallest is at the minimum.

    :math:`\tau + \tau_0 1` with :math:`\tau_0 = \max(0, \tau_{min} - \min_i\tau_i)`. As
    :math:`M_P 1 = 0` the manifold force is unchanged, and no smaller shift keeps the minimum.

    Parameters
    ----------
    tension : array, shape (..., n)
        [N].
    minimum_n : float
        Smallest tension allowed [N].
    always : bool
        Shift down, too, so that the smallest tension equals the minimum exactly.

    Returns
    -------
    array, shape (..., n)
        [N].

    Raises
    ------
    TypeError
        If `tension` is not real.

    Examples
    --------
    >>> import numpy as np
    >>> shift(np.array([2.0, -1.0, -1.0]))
    array([3., 0., 0.])
    """
    tension = as_floating(tension, "tension")
    xp = array_namespace(tension)
    missing = minimum_n - xp.amin(tension, -1)
    if not always:
        missing = xp.where(missing > 0.0, missing, 0.0 * missing)
    return tension + missing[..., None]


def distribute(force: Array, n: int, minimum_n: float = 0.0, method: str = "shift") -> Array:
    r"""Return tensions of at least a minimum for a manifold force.

    Parameters
    ----------
    force : array, shape (..., 2)
        Clarke coordinates of the tensions, :math:`\bar\tau = M_P\tau` [N].
    n : int
        Number of tendons, at least 3.
    minimum_n : float
        Smallest tension allowed [N], e.g. a pretension.
    method : {"shift", "clip"}

    Returns
    -------
    array, shape (..., n)
        [N].

    Raises
    ------
    TypeError, ValueError
        If `force` is not real, its last axis is not 2, or `n` or `method` is impossible.

    Examples
    --------
    >>> import numpy as np
    >>> distribute(np.array([2.0, 0.0]), 4, minimum_n=1.0).round(6)
    array([5., 3., 1., 3.])
    """
    if method not in ("shift", "clip"):
        raise ValueError(f"method must be 'shift' or 'clip', got {method!r}")
    tension = from_clarke(force, n)
    if method == "clip":
        return clip(tension, minimum_n)
    return shift(tension, minimum_n, always=True)
