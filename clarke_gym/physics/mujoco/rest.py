"""Where unloaded robots come to rest whose tendons are not the nominal ones."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray


def resting(
    command: FloatArray,
    stiffness: FloatArray,
    pulls_only: NDArray[np.bool_],
    jacobian: FloatArray,
    elastic: FloatArray,
) -> FloatArray:
    r"""Return the joint coordinates at which tendons balance elastic joints.

    With the tensions T, the joints' stiffness K and the displacements :math:`\rho = Jq`,

    .. math:: K q = J^T T, \qquad T = k\,(c - J q), \qquad T \ge 0 \text{ where tendons only pull,}

    a linear complementarity problem. It is solved by keeping those tendons that are stretched until
    they stay the same (block principal pivoting; Judice and Pires, "A block principal pivoting
    algorithm for large-scale strictly monotone linear complementarity problems", 1994).

    Parameters
    ----------
    command : ndarray, shape (R, N)
        How far drives have pulled tendons in, pretension included: c [m].
    stiffness : ndarray, shape (R, N)
        k [N/m], 0 where a tendon is broken.
    pulls_only : ndarray of bool, shape (N,)
    jacobian : ndarray, shape (R, N, nq)
        J [m/rad].
    elastic : ndarray, shape (R, nq)
        Diagonal of K [N m/rad].

    Returns
    -------
    ndarray, shape (R, nq)
        [rad].

    Examples
    --------
    >>> one, pulls = np.ones((1, 1)), np.array([True])
    >>> resting(one, one, pulls, one[None], one), resting(-one, one, pulls, one[None], one)
    (array([[0.5]]), array([[0.]]))
    """
    there = stiffness > 0.0
    flexible = jacobian / elastic[:, None, :]
    compliance = flexible @ jacobian.transpose(0, 2, 1)
    unit, taut = np.eye(command.shape[1]), there
    for _ in range(2 * command.shape[1] + 2):
        acting = np.where(taut, stiffness, 0.0)
        system = unit + acting[:, :, None] * compliance
        tension = np.linalg.solve(system, (acting * command)[..., None])
        stretched = command - (compliance @ tension)[..., 0] > 0.0
        kept = there & (stretched | ~pulls_only)
        if (kept == taut).all():
            break
        taut = kept
    rest: FloatArray = (flexible.transpose(0, 2, 1) @ tension)[..., 0]
    return rest
