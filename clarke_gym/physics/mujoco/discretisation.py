r"""Where a segment's joints lie, so that few rigid links bend like a continuous rod.

A rod of curvature kappa is cut into elements of length H, each with two joints at
:math:`H/2 \pm \eta H` that turn by :math:`\kappa H/2`. To second order in H the end of an element
misses the true arc by

.. math:: -H^2\left[(\eta^2 - \tfrac1{12})\,\kappa' n
          + (\tfrac1{12} - \tfrac\eta4)\,\kappa^2 t\right] \text{ per unit length}

along its normal n and tangent t (expand the arc and the three links about the element's middle).
Evenly spaced joints, :math:`\eta = 1/4`, make every chord short by :math:`\kappa^2 h^2/12` with the
joint spacing h = H/2: the tangent polygon. Joints at the nodes make it long by
:math:`\kappa^2 h^2/24`: the chord polygon. With :math:`\eta = 1/3` the chord is right to fourth
order, so a tendon-driven segment, whose curvature is constant but for external loads, needs no
further links. No pair of joints cancels both terms: tendon-driven shapes decide for 1/3.
"""

from __future__ import annotations

import numpy as np

from clarke_gym.numerics.arrays import FloatArray

JOINT_OFFSET = 1.0 / 3.0
"""Distance eta of an element's two joints from its middle, over the element's length."""


def joint_positions(length: float, elements: int) -> FloatArray:
    """Return the arc lengths of a segment's joints.

    Parameters
    ----------
    length : float
        Segment length [m].
    elements : int
        Elements of two joints each.

    Returns
    -------
    ndarray, shape (2 * elements,)
        [m] from the segment's base, ascending. Each joint stands for ``length / (2 * elements)``
        of backbone.

    Examples
    --------
    >>> joint_positions(1.2, 2).round(3)
    array([0.1, 0.5, 0.7, 1.1])
    """
    size = length / elements
    middles = (np.arange(elements) + 0.5) * size
    offset = JOINT_OFFSET * size
    return np.stack([middles - offset, middles + offset], axis=1).ravel()
