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


BLOCK = 1 << 14
"""Distances that are computed at once: more would leave the cache."""

EMPTY = Scene()
"""No bodies: contact stays off."""


def body_distance(points: FloatArray, numbers: FloatArray) -> FloatArray:
    """Return how far the surfaces of capsules are from the nearest of some points.

    Parameters
    ----------
    points : ndarray, shape (..., P, 3)
        [m].
    numbers : ndarray, shape (..., K, 7)
        Ends of each axis and radius [m].

    Returns
    -------
    ndarray, shape (..., K)
        [m], negative where a point is inside.

    Examples
    --------
    >>> bar = Scene((Capsule((0.1, -1.0, 0.1), (0.1, 1.0, 0.1), 0.01),)).numbers
    >>> body_distance(np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.2]]), bar).round(9)
    array([0.09])
    """
    lead = np.broadcast_shapes(points.shape[:-2], numbers.shape[:-2])
    points, numbers = (
        np.broadcast_to(array, (*lead, *array.shape[-2:])).reshape(-1, *array.shape[-2:])
        for array in (points, numbers)
    )
    return _Capsules(numbers).distance(points).reshape(*lead, numbers.shape[1])


class _Capsules:
    """What capsules around each of B robots are to points, whatever these are.

    Of the numbers (x, y, z, their square, 1) of a point two things are linear: how far along an
    axis it is [m], and the square of its distance from the axis' start [m^2].

    Parameters
    ----------
    numbers : ndarray, shape (B, K, 7)
        Ends of each axis and radius [m].
    """

    def __init__(self, numbers: FloatArray) -> None:
        start, self.radius = numbers[..., :3], numbers[..., 6].copy()
        axis = numbers[..., 3:6] - start
        self.length = np.sqrt(np.vecdot(axis, axis))
        # A sphere's axis of length 0 leaves all points at its start.
        axis = axis / np.where(self.length > 0.0, self.length, 1.0)[..., None]
        forms = np.zeros((2, *self.length.shape, 5))
        forms[0, ..., :3], forms[0, ..., 4] = axis, -np.vecdot(axis, start)
        forms[1, ..., :3], forms[1, ..., 3] = -2.0 * start, 1.0
        forms[1, ..., 4] = np.vecdot(start, start)
        self.forms = forms.swapaxes(-1, -2)
        self._rooms: dict[tuple[int, int], _Room] = {}

    def place(self, rows: NDArray[np.intp], other: _Capsules) -> None:
        """Take the capsules of the robots `rows` from others, one after the other."""
        self.forms[:, rows] = other.forms
        self.length[rows], self.radius[rows] = other.length, other.radius

    def distance(self, points: FloatArray) -> FloatArray:
        """Return how far each surface is from the nearest of the points (B, P, 3), (B, K)."""
        robots, bodies = self.length.shape
        least = np.empty((robots, bodies))
        width = min(points.shape[1], max(1, BLOCK // bodies))
        chunk = max(1, BLOCK // (bodies * width))
        for k in range(0, robots, chunk):
            rows = slice(k, k + chunk)
            square = self._square(points[rows, :width], rows)
            for j in range(width, points.shape[1], width):
                np.minimum(square, self._square(points[rows, j : j + width], rows), out=square)
            # The root grows with its square: of all points it is drawn for the nearest alone.
            np.sqrt(np.maximum(square, 0.0, out=square), out=least[rows])
        least -= self.radius
        return least

    def _square(self, points: FloatArray, rows: slice) -> FloatArray:
        """Return the least square of the distance of points from each axis, (R, K)."""
        size = len(points), points.shape[1]
        if size not in self._rooms:
            self._rooms[size] = _Room(*size, self.length.shape[1])
        return self._rooms[size].least_square(points, self.forms[:, rows], self.length[rows])


class _Room:
    """Memory for R robots' distances: fresh one for large batches costs more than the sums do."""

    def __init__(self, robots: int, points: int, bodies: int) -> None:
        self._lifted = np.ones((5, robots, points))
        self._squares = np.empty((3, robots, points))
        self._factor = self._lifted.transpose(1, 2, 0)
        products = np.empty((2, points, robots, bodies))
        self._products, (self._along, self._square) = products.swapaxes(1, 2), products
        self._nearest = np.empty((points, robots, bodies))
        self._start = np.zeros((robots, bodies))  # met faster than a single zero

    def least_square(self, points: FloatArray, forms: FloatArray, length: FloatArray) -> FloatArray:
        """Return the least square of the distance of points (R, P, 3) from each axis, (R, K)."""
        place, along, square, nearest = self._lifted[:3], self._along, self._square, self._nearest
        place[...] = points.transpose(2, 0, 1)
        np.add.reduce(np.multiply(place, place, out=self._squares), out=self._lifted[3])
        # Products of a fixed size, one a robot: their bits do not depend on how many there are.
        np.matmul(self._factor, forms, out=self._products)
        np.minimum(np.maximum(along, self._start, out=nearest), length, out=nearest)
        # What is left of it: s^2 - a^2 + (a - n)^2 = s^2 - n (2 a - n).
        along += along
        along -= nearest
        along *= nearest
        square -= along
        least: FloatArray = np.minimum.reduce(square)
        return least


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
        self._numbers = np.tile(scene.numbers, (num_envs, 1, 1))
        self._capsules = _Capsules(self._numbers)
        self.numbers = self._numbers.view()
        """Ends of each axis and radius [m], shape (B, K, 7), to read."""
        self.numbers.flags.writeable = False

    def place(self, rows: NDArray[np.intp], numbers: FloatArray) -> None:
        """Put the bodies around the robots `rows` to `numbers`, shape (R, K, 7)."""
        self._numbers[rows] = numbers
        self._capsules.place(rows, _Capsules(numbers))

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
        gaps: FloatArray = np.minimum.reduce(self._capsules.distance(backbone), axis=1)
        gaps -= self._hull_m
        return gaps
