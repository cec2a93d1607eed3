"""How much a segment's round backbone resists bending, twisting and stretching."""

from __future__ import annotations

import math

from clarke_gym.robots.robot import Segment


def _second_moment(segment: Segment) -> float:
    """Return I of a segment's round backbone [m^4]."""
    return math.pi * segment.backbone_diameter_m**4 / 64.0


def bending_stiffness(segment: Segment) -> float:
    """Return E I of a segment's round backbone.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    float
        [N m^2]

    Examples
    --------
    >>> round(bending_stiffness(Segment()), 5)
    0.01018
    """
    return segment.youngs_modulus_pa * _second_moment(segment)


def torsional_stiffness(segment: Segment) -> float:
    """Return G J of a segment's round backbone, with J = 2 I.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    float
        [N m^2]

    Examples
    --------
    >>> round(torsional_stiffness(Segment()), 5)
    0.00783
    """
    return segment.shear_modulus_pa * 2.0 * _second_moment(segment)


def axial_stiffness(segment: Segment) -> float:
    """Return E A of a segment's round backbone.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    float
        [N]

    Examples
    --------
    >>> round(axial_stiffness(Segment()))
    83127
    """
    return segment.youngs_modulus_pa * math.pi * segment.backbone_diameter_m**2 / 4.0
