"""What stands around a robot: bodies in the frame of its base."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

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
    >>> Capsule((0.1, -1.0, 0.1), (0.1, 1.0, 0.1), 0.01).is_sphere
    False
    """

    start_m: Sequence[float]
    end_m: Sequence[float]
    radius_m: float

    def __post_init__(self) -> None:
        for name in ("start_m", "end_m"):
            numbers = check_vector(name, getattr(self, name), 3)
            object.__setattr__(self, name, tuple(numbers.tolist()))
        check_positive("radius_m", self.radius_m)

    @property
    def is_sphere(self) -> bool:
        """Whether both ends of the axis are the same point."""
        return self.start_m == self.end_m


@dataclass(frozen=True)
class Scene:
    """Bodies that a robot must not touch, or may lean on.

    MuJoCo simulates their contact with the robot (not of the robot with itself). With constant
    curvature, whose shape nothing bends, only the clearance tells of them.

    Parameters
    ----------
    bodies : tuple of Capsule
    placed : bool
        Whether every episode puts the bodies somewhere else (`Task.places`). A sphere stays a
        sphere, and a rod as long as it is.
    resized : bool
        Whether it gives them other radii, too.

    Examples
    --------
    >>> Scene((Capsule((0.0, 0.0, 0.5), (0.0, 0.0, 0.5), 0.1),)).numbers
    array([[0. , 0. , 0.5, 0. , 0. , 0.5, 0.1]])
    """

    bodies: tuple[Capsule, ...] = field(default=())
    placed: bool = False
    resized: bool = False

    @cached_property
    def numbers(self) -> FloatArray:
        """Ends of each axis and radius [m], shape (K, 7)."""
        rows = [[*body.start_m, *body.end_m, body.radius_m] for body in self.bodies]
        return np.array(rows, np.float64).reshape(-1, 7)


CHUNK = 64
"""Robots whose distances are computed at once."""

EMPTY = Scene()
"""No bodies: contact stays off."""


def axis_distance(points: FloatArray, numbers: FloatArray) -> FloatArray:
    """Return how far points are from the surfaces of capsules, negative inside.

    Parameters
    ----------
    points : ndarray, shape (..., P, 3)
        [m].
    numbers : ndarray, shape (..., K, 7)
        Ends of each axis and radius [m].

    Returns
    -------
    ndarray, shape (..., K, P)
        [m].

    Examples
    --------
    >>> bar = Scene((Capsule((0.1, -1.0, 0.1), (0.1, 1.0, 0.1), 0.01),)).numbers
    >>> axis_distance(np.array([[0.0, 0.0, 0.1]]), bar).round(9)
    array([[0.09]])
    """
    place, start = np.moveaxis(points, -1, 0), np.moveaxis(numbers[..., :3], -1, 0)
    axis = np.moveaxis(numbers[..., 3:6], -1, 0) - start
    square = axis[0] ** 2 + axis[1] ** 2 + axis[2] ** 2
    # A sphere's axis of length 0 leaves all projections at 0.
    inverse = 1.0 / np.where(square > 0.0, square, 1.0)
    x, y, z = (p[..., None, :] - s[..., None] for p, s in zip(place, start, strict=True))
    reach = x * axis[0][..., None]
    reach += y * axis[1][..., None]
    reach += z * axis[2][..., None]
    along = np.minimum(np.maximum(reach * inverse[..., None], 0.0), 1.0)
    x -= along * axis[0][..., None]
    y -= along * axis[1][..., None]
    z -= along * axis[2][..., None]
    x *= x
    y *= y
    z *= z
    x += y
    x += z
    distance: FloatArray = np.sqrt(x, out=x)
    distance -= numbers[..., 6, None]
    return distance


class Surroundings:
    """The bodies of a scene around each of B robots.

    Parameters
    ----------
    scene : Scene
    num_envs : int

    Examples
    --------
    >>> scene = Scene((Capsule((0.0, 0.0, 0.5), (0.0, 0.0, 0.5), 0.1),))
    >>> Surroundings(scene, 1).clearance(np.zeros((1, 2, 3)), 0.01).round(9)
    array([0.39])
    """

    def __init__(self, scene: Scene, num_envs: int) -> None:
        self.scene, self._num_envs = scene, num_envs
        count = num_envs if scene.placed else 1
        self._numbers = np.tile(scene.numbers, (count, 1, 1))

    @property
    def numbers(self) -> FloatArray:
        """Ends of each axis and radius [m], shape (B, K, 7), to read."""
        return np.broadcast_to(self._numbers, (self._num_envs, *self._numbers.shape[1:]))

    def place(self, rows: NDArray[np.intp], numbers: FloatArray) -> None:
        """Put the bodies around the robots `rows` to `numbers`, shape (R, K, 7)."""
        self._numbers[rows] = numbers

    def clearance(self, backbone: FloatArray, radius: float) -> FloatArray:
        """Return the smallest gap between each robot and its bodies.

        Parameters
        ----------
        backbone : ndarray, shape (B, P, 3)
            Points along the backbones [m].
        radius : float
            How far the robot reaches from its backbone [m].

        Returns
        -------
        ndarray, shape (B,)
            [m], negative where they overlap; infinite without bodies.
        """
        if not self.scene.bodies:
            return np.full(self._num_envs, np.inf)
        gaps = np.empty(self._num_envs)
        for k in range(0, self._num_envs, CHUNK):  # more at once would leave the cache
            rows = slice(k, k + CHUNK)
            bodies = self._numbers[rows] if self.scene.placed else self._numbers
            gaps[rows] = axis_distance(backbone[rows], bodies).min(axis=(1, 2))
        return gaps - radius
