"""Sampling on the manifold: uniform over the Clarke disk, or any distribution on it.

Draws that are uniform over the tips instead are `clarke_gym.kinematics.sample_tips`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from clarke_gym.numerics.arrays import Array, array_namespace
from clarke_gym.numerics.checks import check_last_axis, check_positive


def sample_disk(uniforms: Array, radius: float) -> Array:
    r"""Return Clarke coordinates uniform over the disk :math:`|\bar\rho| \le r`.

    Closed form without rejection: :math:`r\sqrt{U}(\cos 2\pi V, \sin 2\pi V)`. (Branchless
    closed-form sampling on the manifold is due to "Clarke Transform - A Fundamental Tool for
    Continuum Robotics", arXiv 2409.16501, whose formulas were not read.)

    Parameters
    ----------
    uniforms : array, shape (..., 2)
        Independent uniform numbers in [0, 1).
    radius : float
        r [m].

    Returns
    -------
    array, shape (..., 2)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `uniforms` is not real, its last axis not 2, or `radius` not positive.

    Examples
    --------
    >>> import numpy as np
    >>> sample_disk(np.array([[0.25, 0.0], [1.0, 0.25]]), 0.01).round(6)
    array([[0.005, 0.   ],
           [0.   , 0.01 ]])
    """
    return sample_shaped(uniforms, radius, lambda share: share**0.5)


def sample_shaped(uniforms: Array, radius: float, quantile: Callable[[Array], Array]) -> Array:
    """Return Clarke coordinates of any rotationally symmetric distribution on the disk.

    Parameters
    ----------
    uniforms : array, shape (..., 2)
        Independent uniform numbers in [0, 1).
    radius : float
        r [m].
    quantile : callable
        Inverse distribution function of the magnitude over r: [0, 1) to [0, 1], increasing. The
        square root is uniform on the disk, the identity uniform in the magnitude.

    Returns
    -------
    array, shape (..., 2)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `uniforms` is not real, its last axis not 2, or `radius` not positive.

    Examples
    --------
    >>> import numpy as np
    >>> sample_shaped(np.array([0.5, 0.5]), 0.01, lambda share: share).round(6) + 0.0
    array([-0.005,  0.   ])
    """
    uniforms = check_last_axis(uniforms, 2, "uniforms")
    xp = array_namespace(uniforms)
    magnitude = check_positive("radius", radius) * quantile(uniforms[..., 0])
    angle = 2.0 * math.pi * uniforms[..., 1]
    return xp.stack([magnitude * xp.cos(angle), magnitude * xp.sin(angle)], -1)
