r"""The registry of representations: pairs of pure maps over the last axis of a joint-space array.

`decode` takes a policy's numbers to joint space, `encode` takes joint-space numbers to what the
policy sees. Physics, limits, tasks and rewards never see a representation, so every arm of a
comparison solves the same problem.

==================  ====  ==================================================================
name                k     coordinates of one segment with n tendons
==================  ====  ==================================================================
``raw``             n     the tendons' displacements themselves
``raw_scaled``      n     raw times sqrt(n/2): isotropic noise then moves the tip as in Clarke
``projected``       n     displacements, projected onto the manifold
``clarke``          2     Clarke coordinates
``rotated``         2     Clarke coordinates in axes turned by a fixed angle
``two_tendon``      2     displacements of the two tendons closest to a right angle
``random_basis``    2     a fixed basis of the manifold with condition number 10
``arc_polar``       2     curvature and bending-plane angle: singular when straight
``clarke_bends``    2     Clarke coordinates of a segment's own bend, without what its tendons
                          follow of the segments that they pass; alone a distal one
                          cannot ask for full speed
``clarke_common``   3     Clarke coordinates and the common mode (co-contraction)
``antagonistic``    2     half differences of opposite tendons; n = 4 only
published names     2     Clarke in the axes of `clarke_gym.clarke.parametrisations`, e.g.
                          ``della_santina_2020``, ``allen_2020``: limits set the scale
==================  ====  ==================================================================

`clarke_gym.representations.instruments` adds those that only take causes apart.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.clarke.parametrisations import PARAMETRISATIONS, Parametrisation
from clarke_gym.clarke.transform import layout_matrices
from clarke_gym.kinematics.coupling import bending_to_clarke
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_last_axis
from clarke_gym.numerics.linear_map import block_diagonal, map_rows
from clarke_gym.numerics.registry import Registry
from clarke_gym.representations.instruments import INSTRUMENTS
from clarke_gym.robots.robot import Robot, Segment

ROTATION_RAD = 0.7
"""Angle of the ``rotated`` axes: not a symmetry of any ring of tendons."""

RANDOM_BASIS_CONDITION = 10.0
"""Condition number of ``random_basis``."""

LinearMaps = tuple[NDArray[Any], NDArray[Any]]


def _raw(segment: Segment) -> LinearMaps:
    identity = np.eye(segment.n_tendons)
    return identity, identity


def _raw_scaled(segment: Segment) -> LinearMaps:
    gain = math.sqrt(segment.n_tendons / 2.0)
    identity = np.eye(segment.n_tendons)
    return gain * identity, identity / gain


def _projected(segment: Segment) -> LinearMaps:
    encoder, decoder = segment.matrices
    return decoder @ encoder, decoder @ encoder


def _clarke(segment: Segment) -> LinearMaps:
    encoder, decoder = segment.matrices
    return decoder, encoder


def _on_manifold(segment: Segment, basis: NDArray[Any]) -> LinearMaps:
    """Coordinates z with rho_bar = basis @ z."""
    encoder, decoder = segment.matrices
    return decoder @ basis, np.linalg.solve(basis, encoder)


def _rotated(segment: Segment) -> LinearMaps:
    c, s = math.cos(ROTATION_RAD), math.sin(ROTATION_RAD)
    return _on_manifold(segment, np.array([[c, -s], [s, c]]))


def _two_tendon(segment: Segment) -> LinearMaps:
    decoder, angles = segment.matrices[1], segment.angles
    sines = np.abs(np.sin(angles[:, None] - angles)).round(12)
    pair = np.unravel_index(np.argmax(sines), sines.shape)  # the first of equals, but for rounding
    return _on_manifold(segment, np.linalg.inv(decoder[[*pair]]))


def _random_basis(segment: Segment) -> LinearMaps:
    left, right = (np.linalg.qr(m)[0] for m in np.random.default_rng(7).normal(size=(2, 2, 2)))
    root = math.sqrt(RANDOM_BASIS_CONDITION)
    return _on_manifold(segment, left @ np.diag([root, 1.0 / root]) @ right)


def _clarke_common(segment: Segment) -> LinearMaps:
    decoder = np.column_stack([segment.matrices[1], np.ones(segment.n_tendons)])
    return decoder, np.linalg.pinv(decoder)


def _antagonistic(segment: Segment) -> LinearMaps:
    if segment.n_tendons != 4:
        raise ValueError(
            f"representation 'antagonistic' needs n_tendons=4 (two opposite pairs), "
            f"got {segment.n_tendons}"
        )
    pairs = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    return pairs, 0.5 * pairs.T


def _published(parametrisation: Parametrisation) -> Callable[[Segment], LinearMaps]:
    return lambda segment: _on_manifold(segment, parametrisation.matrix.T)


REPRESENTATIONS: Registry[Callable[[Segment], LinearMaps]] = Registry("representation")
"""Functions of a segment that return (decoder (n, k), encoder (k, n)), by name."""

for _name, _maps in (
    ("raw", _raw),
    ("raw_scaled", _raw_scaled),
    ("projected", _projected),
    ("clarke", _clarke),
    ("rotated", _rotated),
    ("two_tendon", _two_tendon),
    ("random_basis", _random_basis),
    ("clarke_common", _clarke_common),
    ("antagonistic", _antagonistic),
    *((name, _published(entry)) for name, entry in PARAMETRISATIONS.items()),
    ("arc_polar", _clarke),
    ("clarke_bends", _clarke),
    *INSTRUMENTS.items(),
):
    REPRESENTATIONS.register(_name, _maps)

POLAR = ("arc_polar",)
"""Representations whose pairs are shown as (magnitude, angle)."""

_OWN_BENDS = ("clarke_bends",)
"""Representations of the segments' own bends, whose maps are not segment by segment."""


@dataclass(frozen=True, eq=False)
class Representation:
    """A representation of all tendons of one robot.

    Parameters
    ----------
    name : str
        Its name in the registry.
    decoder : ndarray, shape (N, K)
        Linear map from coordinates to joint space.
    encoder : ndarray, shape (K, N)
        Linear map from joint space to coordinates.
    counts : tuple of int
        How many coordinates each segment has.
    polar : bool
        True if each pair of linear coordinates is shown as (magnitude, angle), both in [-1, 1].
    """

    name: str
    decoder: FloatArray
    encoder: FloatArray
    counts: tuple[int, ...]
    polar: bool = False

    @property
    def size(self) -> int:
        """Number of coordinates K of the whole robot."""
        return self.encoder.shape[0]

    @property
    def labels(self) -> tuple[str, ...]:
        """A name for each coordinate: "1.2" is the second one of the first segment."""
        return tuple(
            f"{s + 1}.{i + 1}" for s, count in enumerate(self.counts) for i in range(count)
        )

    @property
    def n_joints(self) -> int:
        """Number of tendons N of the whole robot."""
        return self.encoder.shape[1]

    def decode(self, coordinates: NDArray[Any]) -> NDArray[Any]:
        """Return joint-space numbers.

        Parameters
        ----------
        coordinates : ndarray, shape (..., K)

        Returns
        -------
        ndarray, shape (..., N)
            In the precision of `coordinates`; float64 for whole numbers.

        Raises
        ------
        ValueError
            If the last axis is not K.
        """
        coordinates = check_last_axis(coordinates, self.size, "coordinates")
        rows = self.linear(coordinates).reshape(-1, self.size)
        joints = map_rows(rows, self.decoder.T.astype(rows.dtype, copy=False))
        return joints.reshape(*coordinates.shape[:-1], joints.shape[1])

    def linear(self, coordinates: NDArray[Any]) -> NDArray[Any]:
        """Return the coordinates that the decoder takes: polar pairs as Cartesian ones.

        Parameters
        ----------
        coordinates : ndarray, shape (..., K)

        Returns
        -------
        ndarray, shape (..., K)
        """
        if not self.polar:
            return coordinates
        magnitude = (coordinates[..., 0::2] + 1.0) / 2.0
        angle = np.pi * coordinates[..., 1::2]
        pairs = np.stack([magnitude * np.cos(angle), magnitude * np.sin(angle)], axis=-1)
        return pairs.reshape(coordinates.shape).astype(coordinates.dtype, copy=False)

    def encode(self, joints: NDArray[Any]) -> NDArray[Any]:
        """Return coordinates of joint-space numbers.

        Parameters
        ----------
        joints : ndarray, shape (..., N)

        Returns
        -------
        ndarray, shape (..., K)
            In the precision of `joints`; float64 for whole numbers.

        Raises
        ------
        ValueError
            If the last axis is not N.
        """
        joints = check_last_axis(joints, self.n_joints, "joints")
        rows = joints.reshape(-1, self.n_joints)
        result = map_rows(rows, self.encoder.T.astype(rows.dtype, copy=False))
        if self.polar:
            to_polar(result)
        return result.reshape(*joints.shape[:-1], self.size)

    def encoded_bound(self, robot: Robot, manifold: float, off_manifold: FloatArray) -> FloatArray:
        """Return the largest magnitude of each coordinate over what joint space can hold.

        Parameters
        ----------
        robot : Robot
            The robot that the representation was made for.
        manifold : float
            Largest magnitude of each segment's Clarke coordinates.
        off_manifold : ndarray, shape (N,)
            Largest off-manifold displacement of each tendon.

        Returns
        -------
        ndarray, shape (K,)
        """
        onto = (self.encoder @ robot.decoder).reshape(self.encoder.shape[0], -1, 2)
        residual = self.encoder - self.encoder @ robot.decoder @ robot.encoder
        residual[np.abs(residual) < 1e-12] = 0.0
        bound = manifold * np.linalg.norm(onto, axis=2).sum(axis=1)
        # What lies off the manifold is seen alike through the encoder and through its residual.
        bound += np.minimum(np.abs(residual) @ off_manifold, np.abs(self.encoder) @ off_manifold)
        if self.polar:
            bound[0::2] = max(1.0, 2.0 * manifold - 1.0)
            bound[1::2] = 1.0
        return bound


def to_polar(pairs: NDArray[Any]) -> None:
    """Turn pairs (x, y) along the last axis into (2 r - 1, angle / pi), in place.

    Parameters
    ----------
    pairs : ndarray, shape (..., 2S)

    Examples
    --------
    >>> pairs = np.array([0.0, 0.5])
    >>> to_polar(pairs)
    >>> pairs
    array([0. , 0.5])
    """
    x, y = pairs[..., 0::2].copy(), pairs[..., 1::2].copy()
    pairs[..., 0::2] = 2.0 * np.sqrt(x * x + y * y) - 1.0
    pairs[..., 1::2] = np.arctan2(y, x) / np.pi


def clarke_layout(
    angles_rad: Sequence[float] | NDArray[Any], radii_m: float | Sequence[float] | NDArray[Any]
) -> Callable[[Segment], LinearMaps]:
    """Return Clarke coordinates of the layout that somebody takes a segment's tendons to have.

    `representation="clarke"` is that of the robot's description. Where the real tendons are
    elsewhere, the maps of their true layout repair what can be repaired.

    Parameters
    ----------
    angles_rad : array_like, shape (n,)
        Angles of the tendons around the backbone [rad].
    radii_m : float or array_like, shape (n,)
        Their distances from it [m].

    Returns
    -------
    callable
        What `register_representation` takes.

    Raises
    ------
    ValueError
        If the layout is impossible, once the maps of a segment are asked for.

    Examples
    --------
    >>> angles = np.array([0.1, 2.0, 4.3])  # not where the ring has them
    >>> register_representation("measured_doctest", clarke_layout(angles, 0.01))
    """

    def maps(segment: Segment) -> LinearMaps:
        encoder, decoder = layout_matrices(angles_rad, radii_m, segment.pitch_radius_m)
        shares = np.asarray(radii_m, np.float64) / segment.pitch_radius_m
        if not 0.1 <= np.median(shares) <= 10.0:
            raise ValueError(
                f"clarke_layout: radii_m={radii_m!r} are far from the segment's pitch radius of "
                f"{segment.pitch_radius_m:g} m: are they in another unit?"
            )
        return decoder, encoder

    return maps


def representation_names() -> list[str]:
    """Return the names in the registry.

    Returns
    -------
    list of str

    Examples
    --------
    >>> representation_names()[:3]
    ['raw', 'raw_scaled', 'projected']
    """
    return REPRESENTATIONS.names()


def make_representation(name: str, robot: Robot) -> Representation:
    """Return the representation `name` for `robot`.

    Parameters
    ----------
    name : str
        One of `representation_names()`.
    robot : Robot

    Returns
    -------
    Representation

    Raises
    ------
    ValueError
        If the name is unknown or the representation does not exist for this robot.

    Examples
    --------
    >>> clarke = make_representation("clarke", Robot())
    >>> clarke.decode(np.array([1.0, 0.0])).round(3)
    array([ 1. , -0.5, -0.5])
    """
    maps = [_checked(name, segment) for segment in robot.segments]
    decoder, encoder = (block_diagonal([pair[i] for pair in maps]) for i in (0, 1))
    counts = tuple(encoder.shape[0] for _, encoder in maps)
    if name in _OWN_BENDS:
        coupling = _coupling(robot)
        decoder, encoder = decoder @ coupling, np.linalg.inv(coupling) @ encoder
    return Representation(name, decoder, encoder, counts, name in POLAR)


def _coupling(robot: Robot) -> FloatArray:
    """Return the map from bends to Clarke coordinates of tendons, each over its range."""
    size = 2 * robot.n_segments
    bends = np.eye(size).reshape(size, -1, 2) * robot.max_bending[:, None]
    clarke = bending_to_clarke(bends, robot.pitch_radii) / robot.max_clarke[:, None]
    coupling: FloatArray = clarke.reshape(size, size).T
    return coupling


def _checked(name: str, segment: Segment) -> LinearMaps:
    """Return the maps of a segment, once they are what the registry says."""
    decoder, encoder = (np.asarray(m, np.float64) for m in REPRESENTATIONS[name](segment))
    n = segment.n_tendons
    if decoder.ndim != 2 or decoder.shape[0] != n or encoder.shape != decoder.shape[::-1]:
        raise ValueError(
            f"representation {name!r} must return (decoder, encoder) of the shapes ({n}, k) and "
            f"(k, {n}) for a segment of {n} tendons, got {decoder.shape} and {encoder.shape}"
        )
    if not (np.isfinite(decoder).all() and np.isfinite(encoder).all()):
        raise ValueError(f"representation {name!r} returned numbers that are not finite")
    if np.linalg.matrix_rank(encoder @ segment.matrices[1]) < 2:
        raise ValueError(f"representation {name!r} does not see both directions of bending")
    return decoder, encoder


def register_representation(name: str, maps: Callable[[Segment], LinearMaps]) -> None:
    """Make a representation available as ``representation=name``.

    Parameters
    ----------
    name : str
        A word of letters, digits and "_".
    maps : callable
        Takes a `clarke_gym.robots.Segment` with n tendons and returns the linear maps
        (decoder (n, k), encoder (k, n)) between k coordinates and joint space.

    Raises
    ------
    ValueError
        If the name is taken.

    Examples
    --------
    >>> def doubled(segment):
    ...     encoder, decoder = segment.matrices
    ...     return decoder / 2.0, 2.0 * encoder
    >>> register_representation("doubled_doctest", doubled)
    """
    REPRESENTATIONS.register(name, maps)
