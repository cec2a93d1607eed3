"""Robots as plain data: dictionaries and YAML files, checked against a schema."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from clarke_gym.numerics.registry import nearest
from clarke_gym.robots.materials import MATERIALS
from clarke_gym.robots.robot import Robot, Segment

PLAUSIBLE: dict[str, tuple[float, float, str]] = {
    "length_m": (1e-3, 10.0, "m"),
    "pitch_radius_m": (1e-4, 0.5, "m"),
    "max_bending_rad": (1e-3, 6.2832, "rad"),
    "tendon_angles_rad": (-12.567, 12.567, "rad"),
    "tendon_radii_m": (1e-4, 0.5, "m"),
    "backbone_diameter_m": (1e-5, 0.1, "m"),
    "youngs_modulus_pa": (1e4, 1e12, "Pa"),
    "shear_modulus_pa": (1e3, 1e12, "Pa"),
    "density_kg_m3": (10.0, 3e4, "kg/m^3"),
    "disk_mass_kg": (0.0, 1.0, "kg"),
    "disk_thickness_m": (1e-5, 0.1, "m"),
    "tendon_stiffness_n_m": (1.0, 1e9, "N/m"),
    "pretension_n": (0.0, 1e4, "N"),
    "damping_time_s": (0.0, 10.0, "s"),
    "max_tendon_speed_m_s": (1e-5, 10.0, "m/s"),
    "max_cocontraction_m": (1e-8, 0.1, "m"),
    "actuator_time_constant_s": (0.0, 10.0, "s"),
}
"""Ranges that robots of this kind lie in: a number outside is in the wrong unit."""

LAYOUT = ("tendon_angles_rad", "tendon_radii_m")
"""What has a number for each tendon, or none for all."""


def _keys(kind: type, data: Any, where: str, extra: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a mapping whose keys are fields of a dataclass, or `extra`."""
    if not isinstance(data, Mapping):
        raise ValueError(f"{where} must be a mapping of numbers by name, got {data!r}")
    known = [field.name for field in fields(kind)] + list(extra)
    for key in data:
        if key not in known:
            raise ValueError(f"{where}: unknown key {key!r}{nearest(key, known)}; known: {known}")
    check_plausible(data, where)
    return dict(data)


def check_plausible(data: Mapping[str, Any], where: str) -> None:
    """Refuse numbers that are in the wrong unit.

    Parameters
    ----------
    data : mapping
        Numbers by the names of `PLAUSIBLE`; others are let through.
    where : str
        What messages call it.

    Raises
    ------
    ValueError
        If a number lies outside its range.

    Examples
    --------
    >>> check_plausible({"length_m": 0.2}, "segment 1")
    """
    for key, values in data.items():
        if key not in PLAUSIBLE or (key in LAYOUT and values is None):
            continue
        low, high, unit = PLAUSIBLE[key]
        values = values.tolist() if isinstance(values, np.ndarray) else values
        if key in LAYOUT and not isinstance(values, list | tuple):
            raise ValueError(f"{where}: {key} must be a list of numbers, got {values!r}")
        for value in values if key in LAYOUT else [values]:
            number = isinstance(value, Real) and not isinstance(value, bool)
            if not number or not low <= value <= high:
                kind = "numbers" if key in LAYOUT else "a number"
                raise ValueError(
                    f"{where}: {key} must be {kind} from {low:g} to {high:g} {unit}, "
                    f"got {values!r}: is it in another unit?"
                )


def robot_from_dict(data: Mapping[str, Any], where: str = "robot") -> Robot:
    """Return the robot that plain data describe.

    Parameters
    ----------
    data : mapping
        The fields of `Robot`; ``segments`` is a list of mappings with the fields of `Segment`. A
        segment may name its ``material`` (of `clarke_gym.robots.MATERIALS`) instead of its moduli
        and density.
    where : str
        What messages call it.

    Returns
    -------
    Robot

    Raises
    ------
    ValueError, TypeError
        If a key is unknown, or a number impossible or implausibly large or small for its unit.

    Examples
    --------
    >>> robot_from_dict({"segments": [{"n_tendons": 4, "material": "tpu"}]}).n_joints
    4
    """
    numbers = _keys(Robot, data, where)
    if "segments" in numbers:
        listed = numbers["segments"]
        if not isinstance(listed, list | tuple) or not listed:
            raise ValueError(f"{where}: segments must be a list of one or more, got {listed!r}")
        numbers["segments"] = tuple(
            _segment(entry, f"{where}: segment {k + 1}") for k, entry in enumerate(listed)
        )
    return Robot(**numbers)


def _segment(data: Any, where: str) -> Segment:
    numbers = _keys(Segment, data, where, extra=("material",))
    material = numbers.pop("material", None)
    if material is not None:
        if material not in MATERIALS:
            raise ValueError(
                f"{where}: material must be one of {sorted(MATERIALS)}, got {material!r}"
                f"{nearest(material, MATERIALS)}"
            )
        numbers = {**asdict(MATERIALS[material]), **numbers}
    try:
        return Segment(**numbers)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{where}: {error}") from None


def robot_from_yaml(path: str | Path) -> Robot:
    """Return the robot that a YAML file describes; see `robot_from_dict`.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Robot

    Raises
    ------
    ValueError
        If the file cannot be read, or does not describe a robot.
    ImportError
        If PyYAML is not installed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "arm.yaml"
    ...     _ = path.write_text("segments: [{n_tendons: 5}]")
    ...     robot_from_yaml(path).n_joints
    5
    """
    try:
        import yaml
    except ImportError:
        raise ImportError("robots in YAML files need PyYAML: pip install pyyaml") from None
    try:
        data = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise ValueError(f"robot {str(path)!r} cannot be read: {error}") from None
    return robot_from_dict({"name": Path(path).stem, **_keys(Robot, data, str(path))}, str(path))
