"""What stands around a robot: bodies in the frame of its base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_positive, check_vector


@dataclass(frozen=True)
class Capsule:
    """A rod with round ends, or a sphere where both ends are the same point.

    Parameters
    ----------
    start_m, end_m : sequence of 3 floats
        Ends of its axis in the frame of the base [m].
    radius_m : float
        [m].

    Raises
    ------
    ValueError
        If a number is not finite or the radius not positive.

    Examples
    --------
    >>> bar = Capsule((0.1, -1.0, 0.1), (0.1, 1.0, 0.1), 0.01)
    >>> bar.distance(np.array([[0.0, 0.0, 0.1]])).round(9)
    array([0.09])
    """

    start_m: Sequence[float]
    end_m: Sequence[float]
    radius_m: float

    def __post_init__(self) -> None:
        for name in ("start_m", "end_m"):
            numbers = check_vector(name, getattr(self, name), 3)
            object.__setattr__(self, name, tuple(numbers.tolist()))
        check_positive("radius_m", self.radius_m)

    def distance(self, points: FloatArray) -> FloatArray:
        """Return how far points (..., 3) are from its surface [m], negative inside."""
        start, end = np.array(self.start_m), np.array(self.end_m)
        axis, reach = end - start, points - start
        square = axis @ axis
        along = np.clip(reach @ axis / square, 0.0, 1.0) if square else 0.0 * reach[..., 0]
        distance: FloatArray = np.linalg.norm(reach - along[..., None] * axis, axis=-1)
        return distance - self.radius_m


@dataclass(frozen=True)
class Scene:
    """Bodies that a robot must not touch, or may lean on.

    MuJoCo simulates their contact with the robot (not of the robot with itself). With constant
    curvature, whose shape nothing bends, only the clearance tells of them.

    Parameters
    ----------
    bodies : tuple of Capsule

    Examples
    --------
    >>> scene = Scene((Capsule((0.0, 0.0, 0.5), (0.0, 0.0, 0.5), 0.1),))
    >>> scene.clearance(np.zeros((1, 2, 3)), 0.01).round(9)
    array([0.39])
    """

    bodies: tuple[Capsule, ...] = field(default=())

    def clearance(self, backbone: FloatArray, radius: float) -> FloatArray:
        """Return the smallest gap between a robot and the bodies.

        Parameters
        ----------
        backbone : ndarray, shape (B, K, 3)
            Points along the backbones [m].
        radius : float
            How far the robot reaches from its backbone [m].

        Returns
        -------
        ndarray, shape (B,)
            [m], negative where they overlap; infinite without bodies.
        """
        gaps = [body.distance(backbone).min(axis=1) for body in self.bodies]
        smallest: FloatArray = np.min([np.full(len(backbone), np.inf), *gaps], axis=0)
        return smallest - radius


EMPTY = Scene()
"""No bodies: contact stays off."""
