"""Robots with published dimensions by name, and how to change some of their numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from clarke_gym.clarke.transform import joint_angles
from clarke_gym.numerics.checks import check_choice, check_count, check_tendon_count, is_positive
from clarke_gym.numerics.registry import Registry
from clarke_gym.robots.description import check_plausible, robot_from_dict, robot_from_yaml
from clarke_gym.robots.materials import MATERIALS
from clarke_gym.robots.robot import Robot, Segment


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

ROBOTS: Registry[Robot] = Registry("robot")
"""Robots by name: the presets, and those of `register_robot`."""

for _name, _robot in PRESETS.items():
    ROBOTS.register(_name, _robot)

MAX_SEGMENTS = 64
"""More segments than any arm has; simulations grow with their number."""

HOLDING_LENGTH_M = 0.4
"""Length that the segments of a robot made by `n_segments` share, if the preset is not longer.

It is that of the two-segment benchmark and about as long as a 1.4 mm nitinol rod with disks of
weight w a metre holds against gravity: (EI / w)^(1/3). Longer arms sag, wind up about their own
axis and swing for seconds; with `segment_length_m` they can be had.
"""


def make_robot(
    robot: str | Mapping[str, Any] | Robot = "default",
    *,
    n_tendons: int | None = None,
    n_segments: int | None = None,
    segment_length_m: float | None = None,
    pitch_radius_m: float | None = None,
    max_bending_rad: float | None = None,
    material: str | None = None,
    max_cocontraction_m: float | None = None,
) -> Robot:
    """Return a preset, or a robot, with some of its numbers replaced in every segment.

    Parameters
    ----------
    robot : str, mapping or Robot
        A name of `ROBOTS`, the path of a YAML file (ending in .yaml or .yml), what such a file
        holds, or a robot.
    n_tendons : int, optional
        Tendons of every segment, spaced symmetrically from the first tendon's angle. Refused where
        the robot's tendons are not: their places would be lost.
    n_segments : int, optional
        Number of segments; allowed where all segments of `robot` are alike. They are as long as
        those of `robot`, but without `segment_length_m` they share `HOLDING_LENGTH_M` if they would
        be longer together; then their pretension rises as their length falls.
    segment_length_m, pitch_radius_m, max_bending_rad : float, optional
        As in `Segment`.
    material : str, optional
        Backbone material: a name of `MATERIALS`.
    max_cocontraction_m : float, optional
        As in `Robot`.

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
    >>> make_robot(n_segments=4).lengths.tolist(), make_robot("two_segment").length_m
    ([0.1, 0.1, 0.1, 0.1], 0.4)
    """
    robot = _described(robot)
    segments = robot.segments
    if n_segments is not None:
        check_count("n_segments", n_segments)
        if n_segments > MAX_SEGMENTS:
            raise ValueError(f"n_segments must be at most {MAX_SEGMENTS}, got {n_segments}")
        if any(segment != segments[0] for segment in segments):
            raise ValueError(f"n_segments needs equal segments; those of {robot.name!r} differ")
        first = segments[0]
        if segment_length_m is None:
            first = _shortened(first, max(HOLDING_LENGTH_M, robot.length_m) / n_segments)
        segments = (first,) * n_segments
    changes = {
        "length_m": segment_length_m,
        "pitch_radius_m": pitch_radius_m,
        "max_bending_rad": max_bending_rad,
    }
    given: dict[str, Any] = {k: value for k, value in changes.items() if value is not None}
    # What is no positive number the segment itself refuses.
    check_plausible(
        {key: value for key, value in given.items() if is_positive(value)},
        "robot",
    )
    if pitch_radius_m is not None and any(segment.tendon_radii_m for segment in segments):
        raise ValueError(
            f"pitch_radius_m={pitch_radius_m!r} would lose where the tendons of robot "
            f"{robot.name!r} are: they have radii of their own"
        )
    if material is not None:
        given.update(asdict(MATERIALS[check_choice("material", material, sorted(MATERIALS))]))
    segments = tuple(
        replace(_with_tendons(segment, n_tendons, robot.name), **given) for segment in segments
    )
    if max_cocontraction_m is None:
        return replace(robot, segments=segments)
    return replace(robot, segments=segments, max_cocontraction_m=max_cocontraction_m)


def _shortened(segment: Segment, longest: float) -> Segment:
    """Return a segment of at most that length, its tendons as far from slack when it bends."""
    if segment.length_m <= longest:
        return segment
    tension = segment.pretension_n * segment.length_m / longest  # bending takes this much more
    return replace(segment, length_m=longest, pretension_n=tension)


def _with_tendons(segment: Segment, n_tendons: int | None, name: str) -> Segment:
    if n_tendons is None:
        return segment
    check_tendon_count(n_tendons, "n_tendons")
    if n_tendons == segment.n_tendons:
        return segment
    turned = segment.angles - segment.angles[0] - joint_angles(segment.n_tendons)
    even = np.allclose(np.exp(1j * turned), 1.0, rtol=0.0, atol=1e-9)
    mirrored = segment.angles[0] - segment.angles - joint_angles(segment.n_tendons)
    even = even or np.allclose(np.exp(1j * mirrored), 1.0, rtol=0.0, atol=1e-9)
    if segment.tendon_radii_m is not None or not even:
        raise ValueError(
            f"n_tendons={n_tendons} would lose where the tendons of robot {name!r} are: they are "
            "not spaced evenly, or have radii of their own"
        )
    angles = None
    if segment.tendon_angles_rad is not None:
        angles = tuple(float(segment.angles[0] + psi) for psi in joint_angles(n_tendons))
    return replace(segment, n_tendons=n_tendons, tendon_angles_rad=angles)


def _described(robot: Any) -> Robot:
    """Return the robot that a name, a file or plain data stand for."""
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, Mapping):
        return robot_from_dict(robot)
    if isinstance(robot, str) and robot.endswith((".yaml", ".yml")):
        return robot_from_yaml(robot)
    if not isinstance(robot, str):
        raise TypeError(
            f"robot must be a name, the path of a YAML file, what it holds, or a Robot, got "
            f"{robot!r}"
        )
    return ROBOTS[robot]


def register_robot(name: str, robot: str | Path | Mapping[str, Any] | Robot) -> None:
    """Make a robot available as ``robot=name``.

    Parameters
    ----------
    name : str
        A word of letters, digits and "_".
    robot : Robot, mapping, str or Path
        The robot, its plain data, or the path of its YAML file.

    Raises
    ------
    ValueError, TypeError
        If the name is taken, or the robot impossible.

    Examples
    --------
    >>> register_robot("stubby_doctest", {"segments": [{"length_m": 0.05, "n_disks": 4}]})
    >>> make_robot("stubby_doctest").length_m
    0.05
    """
    found = robot_from_yaml(robot) if isinstance(robot, Path) else _described(robot)
    ROBOTS.register(name, replace(found, name=name))
