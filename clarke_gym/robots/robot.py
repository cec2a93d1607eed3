"""Frozen, validated descriptions of tendon-driven continuum robots."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from clarke_gym.clarke.transform import joint_angles, layout_matrices
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import (
    check_count,
    check_not_negative,
    check_positive,
    check_tendon_count,
)
from clarke_gym.numerics.linear_map import block_diagonal
from clarke_gym.robots.materials import MATERIALS

JOINT_TYPES = ("tendon", "rod", "bellows")


@dataclass(frozen=True)
class Segment:
    """One segment: a slender backbone bent by tendons at a pitch radius.

    Parameters
    ----------
    length_m : float
        Backbone length l [m].
    n_tendons : int
        Tendons that end in this segment, at least 3.
    pitch_radius_m : float
        Nominal distance d of the tendons from the backbone [m].
    max_bending_rad : float
        Largest bending angle l·kappa [rad], below 2 pi.
    tendon_angles_rad : tuple of float, optional
        Angle psi_i of each tendon [rad] in the untwisted base frame; symmetric from 0 by default.
    tendon_radii_m : tuple of float, optional
        Distance d_i of each tendon [m]; `pitch_radius_m` by default.
    backbone_diameter_m : float
        Diameter of the round backbone [m].
    youngs_modulus_pa, shear_modulus_pa : float
        Elastic moduli E and G of the backbone [Pa].
    density_kg_m3 : float
        Density of the backbone [kg/m^3].
    n_disks : int
        Spacer disks along the segment, the last one at its end.
    disk_mass_kg : float
        Mass of one disk [kg].
    disk_thickness_m : float
        Thickness of one disk [m]; all disks must fit into the segment.
    joint_type : {"tendon", "rod", "bellows"}
        What actuates the segment: tendons only pull; push-pull rods and bellows also push. MuJoCo
        simulates bellows as rods, although they cannot pull.
    tendon_stiffness_n_m : float
        Axial stiffness of one tendon, rod or bellows [N/m].
    pretension_n : float
        Tension of every tendon of the straight robot at rest [N].
    damping_time_s : float
        Ratio of the backbone's viscous to its elastic moduli (Kelvin and Voigt) [s].

    Raises
    ------
    ValueError, TypeError
        If a value is impossible; the message names the argument, the value and what is allowed.

    Examples
    --------
    >>> Segment(n_tendons=7).max_clarke_m  # d times the largest bending angle
    0.015707963267948967
    """

    length_m: float = 0.2
    n_tendons: int = 3
    pitch_radius_m: float = 0.01
    max_bending_rad: float = math.pi / 2
    tendon_angles_rad: tuple[float, ...] | None = None
    tendon_radii_m: tuple[float, ...] | None = None
    backbone_diameter_m: float = 1.4e-3
    youngs_modulus_pa: float = MATERIALS["nitinol"].youngs_modulus_pa
    shear_modulus_pa: float = MATERIALS["nitinol"].shear_modulus_pa
    density_kg_m3: float = MATERIALS["nitinol"].density_kg_m3
    n_disks: int = 10
    disk_mass_kg: float = 2e-4
    disk_thickness_m: float = 1e-3
    joint_type: str = "tendon"
    tendon_stiffness_n_m: float = 2e5
    pretension_n: float = 10.0
    damping_time_s: float = 0.01

    def __post_init__(self) -> None:
        n = check_tendon_count(self.n_tendons, "n_tendons")
        for name in (
            "length_m",
            "pitch_radius_m",
            "max_bending_rad",
            "backbone_diameter_m",
            "youngs_modulus_pa",
            "shear_modulus_pa",
            "density_kg_m3",
            "disk_thickness_m",
            "tendon_stiffness_n_m",
        ):
            check_positive(name, getattr(self, name))
        for name in ("disk_mass_kg", "pretension_n", "damping_time_s"):
            check_not_negative(name, getattr(self, name))
        if self.joint_type not in JOINT_TYPES:
            raise ValueError(f"joint_type must be one of {JOINT_TYPES}, got {self.joint_type!r}")
        if self.max_bending_rad >= 2.0 * math.pi:
            raise ValueError(f"max_bending_rad must be below 2 pi, got {self.max_bending_rad!r}")
        check_count("n_disks", self.n_disks)
        if self.n_disks * self.disk_thickness_m > self.length_m:
            raise ValueError(
                f"disks overlap: n_disks={self.n_disks} of disk_thickness_m="
                f"{self.disk_thickness_m!r} do not fit into length_m={self.length_m!r}"
            )
        for name in ("tendon_angles_rad", "tendon_radii_m"):
            values = getattr(self, name)
            if values is not None:
                if np.shape(values) != (n,):
                    given = len(values) if np.ndim(values) == 1 else repr(values)
                    raise ValueError(f"{name} must hold n_tendons={n} numbers, got {given}")
                object.__setattr__(self, name, tuple(float(value) for value in values))
        _ = self.matrices  # raises on a layout that cannot bend in every direction

    @property
    def angles(self) -> FloatArray:
        """Tendon angles psi [rad], shape (n,)."""
        if self.tendon_angles_rad is None:
            return joint_angles(self.n_tendons)
        return np.array(self.tendon_angles_rad)

    @property
    def radii(self) -> FloatArray:
        """Tendon distances d_i from the backbone [m], shape (n,)."""
        return np.array(self.tendon_radii_m or (self.pitch_radius_m,) * self.n_tendons)

    @cached_property
    def matrices(self) -> tuple[FloatArray, FloatArray]:
        """Encoder (2, n) and decoder (n, 2) of this tendon layout."""
        return layout_matrices(self.angles, self.radii, self.pitch_radius_m)

    @property
    def max_clarke_m(self) -> float:
        """Largest magnitude of the segment's own Clarke coordinates, d times the bending limit."""
        return self.pitch_radius_m * self.max_bending_rad


@dataclass(frozen=True)
class Robot:
    """Segments in series from base to tip, their tendons, and the limits of the drives.

    Joint space is the displacement of every tendon, segment by segment from the base: N numbers.
    Tendons of a distal segment pass through the proximal ones, so with the segment's own Clarke
    coordinates c_k = d_k·beta_k the Clarke coordinates of its tendons are
    rho_bar_j = sum over k <= j of (d_j / d_k) c_k: lower block-triangular.

    Parameters
    ----------
    segments : tuple of Segment
        From base to tip, at least one.
    max_tendon_speed_m_s : float
        Largest rate of the first segment's Clarke coordinates [m/s], and of its tendons where none
        is farther away than `pitch_radius_m`. `tendon_speeds` holds those of all segments.
    max_cocontraction_m : float
        Largest displacement of any tendon off the manifold [m].
    actuator_time_constant_s : float
        Time constant of the drives' first-order lag [s]; 0 for ideal drives.
    name : str
        Shown in messages and pictures.

    Raises
    ------
    ValueError, TypeError
        If a value is impossible.

    Examples
    --------
    >>> robot = Robot((Segment(n_tendons=3), Segment(n_tendons=4)))
    >>> robot.n_joints, robot.length_m
    (7, 0.4)
    """

    segments: tuple[Segment, ...] = field(default_factory=lambda: (Segment(),))
    max_tendon_speed_m_s: float = 0.02
    max_cocontraction_m: float = 2e-4
    actuator_time_constant_s: float = 0.05
    name: str = "custom"

    def __post_init__(self) -> None:
        object.__setattr__(self, "segments", tuple(self.segments))
        if not self.segments or not all(isinstance(s, Segment) for s in self.segments):
            raise ValueError(f"segments must hold at least one Segment, got {self.segments!r}")
        check_positive("max_tendon_speed_m_s", self.max_tendon_speed_m_s)
        check_positive("max_cocontraction_m", self.max_cocontraction_m)
        check_not_negative("actuator_time_constant_s", self.actuator_time_constant_s)

    @cached_property
    def n_segments(self) -> int:
        """Number of segments S."""
        return len(self.segments)

    @cached_property
    def n_tendons(self) -> tuple[int, ...]:
        """Tendons that end in each segment."""
        return tuple(segment.n_tendons for segment in self.segments)

    @cached_property
    def n_joints(self) -> int:
        """Number of tendons N of the whole robot."""
        return sum(self.n_tendons)

    @cached_property
    def length_m(self) -> float:
        """Length of the straight robot [m]."""
        return sum(segment.length_m for segment in self.segments)

    @cached_property
    def lengths(self) -> FloatArray:
        """Segment lengths [m], shape (S,)."""
        return np.array([segment.length_m for segment in self.segments])

    @cached_property
    def pitch_radii(self) -> FloatArray:
        """Nominal pitch radii d_j [m], shape (S,)."""
        return np.array([segment.pitch_radius_m for segment in self.segments])

    @cached_property
    def max_bending(self) -> FloatArray:
        """Bending limits [rad], shape (S,)."""
        return np.array([segment.max_bending_rad for segment in self.segments])

    @cached_property
    def max_clarke(self) -> FloatArray:
        """Largest magnitude of each segment's tendons' Clarke coordinates [m], shape (S,)."""
        return self.pitch_radii * np.cumsum(self.max_bending)

    @cached_property
    def joint_scale(self) -> FloatArray:
        """The same for each tendon [m], shape (N,): what joint-space numbers are scaled by."""
        return np.repeat(self.max_clarke, self.n_tendons)

    @cached_property
    def tendon_speeds(self) -> FloatArray:
        """Speed limit of each segment's tendons [m/s], shape (S,).

        Distal tendons also follow the bends of the segments that they pass, so they are as much
        faster as their range is longer: all segments cross their range in the same time.
        """
        return self.max_tendon_speed_m_s * (self.max_clarke / self.max_clarke[0])

    @cached_property
    def encoder(self) -> FloatArray:
        """Block-diagonal Clarke transform of all segments, shape (2S, N)."""
        return block_diagonal([segment.matrices[0] for segment in self.segments])

    @cached_property
    def decoder(self) -> FloatArray:
        """Block-diagonal inverse transform of all segments, shape (N, 2S)."""
        return block_diagonal([segment.matrices[1] for segment in self.segments])
