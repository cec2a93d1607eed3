"""Frozen, validated descriptions of tendon-driven continuum robots, and published presets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from clarke_gym._arrays import FloatArray
from clarke_gym.clarke import check_tendon_count, joint_angles, layout_matrices


def require_positive(name: str, value: float) -> None:
    """Refuse anything but a positive finite number."""
    number = isinstance(value, int | float | np.floating) and not isinstance(value, bool)
    if not number or not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{name} must be a positive finite number, got {value!r}")


JOINT_TYPES = ("tendon", "rod", "bellows")


@dataclass(frozen=True)
class Material:
    """Elastic constants of a backbone.

    Parameters
    ----------
    youngs_modulus_pa, shear_modulus_pa : float
        Moduli E and G [Pa].
    density_kg_m3 : float
        [kg/m^3].
    """

    youngs_modulus_pa: float
    shear_modulus_pa: float
    density_kg_m3: float


MATERIALS = {
    "nitinol": Material(54e9, 54e9 / 2.6, 6450.0),
    "spring_steel": Material(200e9, 200e9 / 2.66, 7870.0),
    "tpu": Material(70e6, 70e6 / 2.8, 1200.0),
}
"""Backbone materials by name; nu is 0.3, 0.33 and 0.4."""


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
        What actuates the segment: tendons only pull; push-pull rods and bellows also push.
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
    youngs_modulus_pa: float = 54e9
    shear_modulus_pa: float = 54e9 / 2.6
    density_kg_m3: float = 6450.0
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
            require_positive(name, getattr(self, name))
        for name in ("disk_mass_kg", "pretension_n", "damping_time_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be finite and >= 0, got {value!r}")
        if self.joint_type not in JOINT_TYPES:
            raise ValueError(f"joint_type must be one of {JOINT_TYPES}, got {self.joint_type!r}")
        if self.max_bending_rad >= 2.0 * math.pi:
            raise ValueError(f"max_bending_rad must be below 2 pi, got {self.max_bending_rad!r}")
        if not isinstance(self.n_disks, int) or self.n_disks < 1:
            raise ValueError(f"n_disks must be a whole number >= 1, got {self.n_disks!r}")
        if self.n_disks * self.disk_thickness_m > self.length_m:
            raise ValueError(
                f"disks overlap: n_disks={self.n_disks} of disk_thickness_m="
                f"{self.disk_thickness_m!r} do not fit into length_m={self.length_m!r}"
            )
        for name in ("tendon_angles_rad", "tendon_radii_m"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, tuple(float(value) for value in values))
                if len(values) != n:
                    raise ValueError(f"{name} must hold n_tendons={n} numbers, got {len(values)}")
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
        Largest rate of a segment's Clarke coordinates [m/s]; bounds each tendon's speed, too.
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
        require_positive("max_tendon_speed_m_s", self.max_tendon_speed_m_s)
        require_positive("max_cocontraction_m", self.max_cocontraction_m)
        tau = self.actuator_time_constant_s
        if not (math.isfinite(tau) and tau >= 0.0):
            raise ValueError(f"actuator_time_constant_s must be finite and >= 0, got {tau!r}")

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

    @property
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
    def encoder(self) -> FloatArray:
        """Block-diagonal Clarke transform of all segments, shape (2S, N)."""
        return block_diagonal([segment.matrices[0] for segment in self.segments])

    @cached_property
    def decoder(self) -> FloatArray:
        """Block-diagonal inverse transform of all segments, shape (N, 2S)."""
        return block_diagonal([segment.matrices[1] for segment in self.segments])


def block_diagonal(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return the matrix with `blocks` along its diagonal and zeros elsewhere."""
    rows, columns = np.cumsum([(0, 0), *(block.shape for block in blocks)], axis=0).T
    result = np.zeros((rows[-1], columns[-1]))
    for k, block in enumerate(blocks):
        result[rows[k] : rows[k + 1], columns[k] : columns[k + 1]] = block
    return result


def _radians(*degrees: float) -> tuple[float, ...]:
    return tuple(math.radians(angle) for angle in degrees)


def _two_segment() -> Robot:
    """Two-segment benchmark of Rao, Peyron, Lilge, Burgner-Kahrs, Front. Robot. AI 7:630245."""
    segment = Segment(tendon_angles_rad=_radians(90.0, -30.0, 210.0))
    return Robot((segment, segment), name="two_segment")


def _two_segment_4() -> Robot:
    """Two-segment benchmark with four tendons a segment, the second turned by 45 degrees."""
    first = Segment(n_tendons=4, tendon_angles_rad=_radians(0.0, 90.0, 180.0, 270.0))
    second = replace(first, tendon_angles_rad=_radians(45.0, 135.0, 225.0, 315.0))
    return Robot((first, second), name="two_segment_4")


def _slim() -> Robot:
    """Two short segments of a thinner backbone and unequal pitch radii."""
    first, second = (
        Segment(
            length_m=0.1,
            pitch_radius_m=radius,
            tendon_angles_rad=_radians(90.0, -30.0, 210.0),
            backbone_diameter_m=1e-3,
            youngs_modulus_pa=60e9,
            shear_modulus_pa=60e9 / 2.6,
        )
        for radius in (0.008, 0.006)
    )
    return Robot((first, second), name="slim")


def _soft_arm() -> Robot:
    """Soft arm with a thick TPU backbone."""
    material = MATERIALS["tpu"]
    segment = Segment(
        length_m=0.4,
        n_tendons=4,
        pitch_radius_m=0.02,
        backbone_diameter_m=0.01,
        youngs_modulus_pa=material.youngs_modulus_pa,
        shear_modulus_pa=material.shear_modulus_pa,
        density_kg_m3=material.density_kg_m3,
        disk_mass_kg=2e-3,
        damping_time_s=0.03,
    )
    return Robot((segment,), name="soft_arm")


def _hardware() -> Robot:
    """Three-segment robot with 3 x 3 tendons of the public servo and motion-capture recordings."""
    layout = (
        (0.06, -3.0589, (0.0092, 0.1303, -0.1395)),
        (0.0625, -2.5615, (0.1411, -0.1228, -0.0183)),
        (0.064, -2.0506, (-0.1351, 0.0243, 0.1108)),
    )
    segments = tuple(
        Segment(
            length_m=length,
            pitch_radius_m=0.0045,
            tendon_angles_rad=tuple(base + 2.0 * math.pi * i / 3 + deviations[i] for i in range(3)),
            backbone_diameter_m=1e-3,
            youngs_modulus_pa=50e9,
            shear_modulus_pa=50e9 / 2.6,
        )
        for length, base, deviations in layout
    )
    return Robot(segments, name="hardware")


PRESETS: dict[str, Robot] = {
    "default": Robot(name="default"),
    "four_tendons": Robot((Segment(n_tendons=4),), name="four_tendons"),
    "five_tendons": Robot((Segment(n_tendons=5),), name="five_tendons"),
    "two_segment": _two_segment(),
    "two_segment_4": _two_segment_4(),
    "slim": _slim(),
    "soft_arm": _soft_arm(),
    "hardware": _hardware(),
}
"""Robots with real dimensions by name; "default" is one segment of the two-segment benchmark."""


def make_robot(
    robot: str | Robot = "default",
    *,
    n_tendons: int | None = None,
    n_segments: int | None = None,
    segment_length_m: float | None = None,
    pitch_radius_m: float | None = None,
    max_bending_rad: float | None = None,
    material: str | None = None,
) -> Robot:
    """Return a preset, or a robot, with some of its numbers replaced in every segment.

    Parameters
    ----------
    robot : str or Robot
        A name of `PRESETS`, or a robot.
    n_tendons : int, optional
        Tendons of every segment, spaced symmetrically from the first tendon's angle.
    n_segments : int, optional
        Number of segments; allowed where all segments of `robot` are alike.
    segment_length_m, pitch_radius_m, max_bending_rad : float, optional
        As in `Segment`.
    material : str, optional
        Backbone material: a name of `MATERIALS`.

    Returns
    -------
    Robot

    Raises
    ------
    ValueError, TypeError
        If the preset is unknown or a number impossible.

    Examples
    --------
    >>> make_robot(n_tendons=7, n_segments=2).n_tendons
    (7, 7)
    """
    if isinstance(robot, str):
        if robot not in PRESETS:
            raise ValueError(f"robot must be one of {sorted(PRESETS)}, got {robot!r}")
        robot = PRESETS[robot]
    elif not isinstance(robot, Robot):
        raise TypeError(f"robot must be a preset's name or a Robot, got {robot!r}")
    segments = robot.segments
    if n_segments is not None:
        if isinstance(n_segments, bool) or not isinstance(n_segments, int) or n_segments < 1:
            raise ValueError(f"n_segments must be a whole number >= 1, got {n_segments!r}")
        if any(segment != segments[0] for segment in segments):
            raise ValueError(f"n_segments needs equal segments; those of {robot.name!r} differ")
        segments = segments[:1] * n_segments
    changes = {
        "length_m": segment_length_m,
        "pitch_radius_m": pitch_radius_m,
        "max_bending_rad": max_bending_rad,
    }
    given: dict[str, Any] = {k: value for k, value in changes.items() if value is not None}
    if pitch_radius_m is not None:
        given["tendon_radii_m"] = None
    if material is not None:
        if material not in MATERIALS:
            raise ValueError(f"material must be one of {sorted(MATERIALS)}, got {material!r}")
        given.update(asdict(MATERIALS[material]))
    segments = tuple(replace(_with_tendons(segment, n_tendons), **given) for segment in segments)
    return replace(robot, segments=segments)


def _with_tendons(segment: Segment, n_tendons: int | None) -> Segment:
    if n_tendons is None:
        return segment
    check_tendon_count(n_tendons, "n_tendons")
    angles = None
    if segment.tendon_angles_rad is not None:
        angles = tuple(float(segment.angles[0] + psi) for psi in joint_angles(n_tendons))
    return replace(segment, n_tendons=n_tendons, tendon_angles_rad=angles, tendon_radii_m=None)
