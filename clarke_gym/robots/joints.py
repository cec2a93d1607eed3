"""Joint types: tendons, push-pull rods and bellows through the same maps.

The displacement rho > 0 always means that the joint's path got shorter, so the segment bends
towards the joint. What differs between the types is held here: which way the actuator's own stroke
points, and whether it can pull, push or both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clarke_gym.numerics.arrays import Array, as_floating
from clarke_gym.numerics.checks import check_choice


@dataclass(frozen=True)
class JointType:
    """What one kind of displacement-actuated joint does.

    Parameters
    ----------
    name : str
    sign : int
        Displacement over stroke: +1 if a positive stroke shortens the path, -1 if it lengthens it.
    pulls, pushes : bool
        Whether it can carry tension, and compression.

    Examples
    --------
    >>> JOINT_TYPES["tendon"].pushes, JOINT_TYPES["rod"].pushes, JOINT_TYPES["bellows"].sign
    (False, True, -1)
    """

    name: str
    sign: int
    pulls: bool
    pushes: bool

    @property
    def force_limits(self) -> tuple[float, float]:
        """Smallest and largest sign of the joint's tension [N]: (0, inf) for a tendon."""
        return (-np.inf if self.pushes else 0.0, np.inf if self.pulls else 0.0)


JOINT_TYPES = {
    "tendon": JointType("tendon", 1, pulls=True, pushes=False),
    "rod": JointType("rod", 1, pulls=True, pushes=True),
    "bellows": JointType("bellows", -1, pulls=False, pushes=True),
}
"""By the names of `clarke_gym.robots.JOINT_TYPES`; a bellows is blown up: its stroke lengthens."""


def joint_type(name: str) -> JointType:
    """Return the joint type of that name.

    Parameters
    ----------
    name : str
        "tendon", "rod" or "bellows".

    Returns
    -------
    JointType

    Raises
    ------
    ValueError
        If there is none.

    Examples
    --------
    >>> joint_type("rod").pulls
    True
    """
    return JOINT_TYPES[check_choice("joint_type", name, sorted(JOINT_TYPES))]


def stroke_to_displacement(stroke: Array, name: str) -> Array:
    """Return the joint displacements that actuator strokes make.

    Parameters
    ----------
    stroke : array, shape (..., n)
        Tendon or rod pulled in, or bellows extended [m].
    name : str
        Joint type.

    Returns
    -------
    array, shape (..., n)
        Displacement rho [m], > 0 when the path gets shorter.

    Raises
    ------
    ValueError, TypeError
        If the type is unknown or `stroke` not real.

    Examples
    --------
    >>> stroke_to_displacement(np.array([0.002, 0.0, 0.0]), "bellows") + 0.0
    array([-0.002,  0.   ,  0.   ])
    """
    return as_floating(stroke, "stroke") * float(joint_type(name).sign)


def displacement_to_stroke(displacement: Array, name: str) -> Array:
    """Return the actuator strokes of joint displacements, the inverse of `stroke_to_displacement`.

    Parameters
    ----------
    displacement : array, shape (..., n)
        rho [m].
    name : str
        Joint type.

    Returns
    -------
    array, shape (..., n)
        Stroke [m].

    Raises
    ------
    ValueError, TypeError
        If the type is unknown or `displacement` not real.

    Examples
    --------
    >>> displacement_to_stroke(np.array([0.002, -0.001, -0.001]), "rod")
    array([ 0.002, -0.001, -0.001])
    """
    return as_floating(displacement, "displacement") * float(joint_type(name).sign)
