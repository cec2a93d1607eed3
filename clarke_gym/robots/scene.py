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
    forms, sizes = _forms(numbers)
    lead = np.broadcast_shapes(points.shape[:-2], numbers.shape[:-2])
    return _distance(points, forms, sizes, _Room(lead, points.shape[-2], numbers.shape[-2]))


def _forms(numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what capsules (..., K, 7) are to points, whatever these are.

    Of the numbers (x, y, z, their square, 1) of a point each is a linear form, (2, ..., K, 5): how
    far along each axis it is [m], and the square of its distance from the axis' start. Then the
    length and the radius of each, (2, ..., K, 1).
    """
    start, radius = numbers[..., :3], numbers[..., 6]
    axis = numbers[..., 3:6] - start
    length = np.sqrt(np.vecdot(axis, axis))
    # A sphere's axis of length 0 leaves all points at its start.
    axis = axis / np.where(length > 0.0, length, 1.0)[..., None]
    forms = np.zeros((2, *length.shape, 5))
    forms[0, ..., :3], forms[0, ..., 4] = axis, -np.vecdot(axis, start)
    forms[1, ..., :3], forms[1, ..., 3] = -2.0 * start, 1.0
    forms[1, ..., 4] = np.vecdot(start, start)
    return forms, np.stack([length, radius])[..., None]


class _Room:
    """Memory for distances: fresh one for large batches costs more than the sums do."""

    def __init__(self, lead: tuple[int, ...], points: int, bodies: int) -> None:
        self.lifted = np.empty((5, *lead, points))
        self.lifted[4] = 1.0
        self.factor = np.moveaxis(self.lifted, 0, -2)
        self.along, self.square, self.nearest = np.empty((3, *lead, bodies, points))


def _distance(points: FloatArray, forms: FloatArray, sizes: FloatArray, room: _Room) -> FloatArray:
    """Return how far points (..., P, 3) are from the surfaces of capsules, (..., K, P)."""
    lifted, along, square, nearest = room.lifted, room.along, room.square, room.nearest
    for k in range(3):
        lifted[k] = points[..., k]
    x, y, z = lifted[:3]
    lifted[3] = x * x + y * y + z * z
    # Products of a fixed size, one a robot: their bits do not depend on how many there are.
    np.matmul(forms[0], room.factor, out=along)
    np.matmul(forms[1], room.factor, out=square)
    np.minimum(np.maximum(along, 0.0, out=nearest), sizes[0], out=nearest)
    # What is left of it: s^2 - a^2 + (a - n)^2 = s^2 - n (2 a - n).
    along += along
    along -= nearest
    along *= nearest
    square -= along
    np.maximum(square, 0.0, out=square)
    distance: FloatArray = np.sqrt(square, out=square)
    distance -= sizes[1]
    return distance


class Surroundings:
    """The bodies of a scene around each of B robots.

    Parameters
    ----------
    scene : Scene
    num_envs : int
    hull_m : float
        How far the robots reach from their backbones [m].

    Examples
    --------
    >>> scene = Scene((Capsule((0.0, 0.0, 0.5), (0.0, 0.0, 0.5), 0.1),))
    >>> Surroundings(scene, 1, 0.01).clearance(np.zeros((1, 2, 3))).round(9)
    array([0.39])
    """

    def __init__(self, scene: Scene, num_envs: int, hull_m: float) -> None:
        self.scene, self._num_envs, self._hull_m = scene, num_envs, hull_m
        count = num_envs if scene.placed else 1
        self._numbers = np.tile(scene.numbers, (count, 1, 1))
        self._forms, self._sizes = _forms(self._numbers)
        self._rooms: dict[tuple[int, int], _Room] = {}

    @property
    def numbers(self) -> FloatArray:
        """Ends of each axis and radius [m], shape (B, K, 7), to read."""
        return np.broadcast_to(self._numbers, (self._num_envs, *self._numbers.shape[1:]))

    def place(self, rows: NDArray[np.intp], numbers: FloatArray) -> None:
        """Put the bodies around the robots `rows` to `numbers`, shape (R, K, 7)."""
        self._numbers[rows] = numbers
        self._forms[:, rows], self._sizes[:, rows] = _forms(numbers)

    def clearance(self, backbone: FloatArray) -> FloatArray:
        """Return the smallest gap between each robot and its bodies.

        Parameters
        ----------
        backbone : ndarray, shape (B, P, 3)
            Points along the backbones [m].

        Returns
        -------
        ndarray, shape (B,)
            [m], negative where they overlap; infinite without bodies.
        """
        if not self.scene.bodies:
            return np.full(self._num_envs, np.inf)
        gaps, points = np.empty(self._num_envs), backbone.shape[1]
        for k in range(0, self._num_envs, CHUNK):  # more at once would leave the cache
            rows = slice(k, k + CHUNK)
            own = rows if self.scene.placed else slice(None)
            size = min(CHUNK, self._num_envs - k), points
            if size not in self._rooms:
                self._rooms[size] = _Room(size[:1], points, len(self.scene.bodies))
            found = _distance(
                backbone[rows], self._forms[:, own], self._sizes[:, own], self._rooms[size]
            )
            gaps[rows] = found.min(axis=(1, 2))
        gaps -= self._hull_m
        return gaps
