"""The MuJoCo model of a robot as an MJCF file, for other programs.

A tendon-driven robot needs cables that only pull and whose commanded length is the input. In MuJoCo
that is a tendon with one actuator whose activation is the commanded length, a stiff spring from
there to the actual length, and a force limited to one sign; `export_mjcf` writes it out.
"""

from __future__ import annotations

import os
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from clarke_gym.numerics.checks import check_choice
from clarke_gym.robots import Robot, make_robot

_EXACT = {
    "option": {"timestep": "timestep", "gravity": "gravity"},
    "body": {"pos": "pos", "quat": "quat"},
    "geom": {"pos": "pos", "quat": "quat", "size": "size", "mass": "mass"},
    "joint": {"stiffness": "stiffness", "damping": "damping"},
    "site": {"pos": "pos"},
    "inertial": {"pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia"},
    "general": {"gainprm": "gainprm", "biasprm": "biasprm"},
}
"""Attributes that MuJoCo would write with six digits and what they are called in its description,
by the tag of their element."""


def mjcf(
    robot: str | Mapping[str, Any] | Robot = "default",
    *,
    folded: bool = False,
    profile: str = "accurate",
    record: int = 0,
    **options: Any,
) -> str:
    """Return the MuJoCo model of a robot as MJCF text, with all digits of its numbers.

    Parameters
    ----------
    robot : str, mapping or Robot
        As `make_robot` takes it.
    folded : bool
        Whether two virtual tendons stand for the n of a segment. They are exact while all n are
        taut, and cannot go slack; by default every tendon is there.
    profile : {"fast", "accurate"}
        Number of links and length of the time step.
    record : int
        Time steps of which sensors keep the lengths of folded tendons.
    **options
        As in `clarke_gym.physics.mujoco.model.build_chain`: `sim_dt_s`, `routing`, `actuation`,
        `gravity_m_s2`, `base_quaternion`, `payload_kg` and `scene`.

    Returns
    -------
    str

    Raises
    ------
    ValueError, TypeError
        If a choice is unknown or a number impossible.

    Examples
    --------
    >>> mjcf(folded=True).count("<general ")  # two virtual tendons
    2
    """
    from clarke_gym.physics.mujoco.model import PROFILES, build_chain  # loads the simulator

    numbers = PROFILES[check_choice("profile", profile, tuple(PROFILES))]
    chain = build_chain(make_robot(robot), numbers, folded=folded, record=record, **options)
    spec: Any = chain.spec
    root = ET.fromstring(spec.to_xml())
    root.set("model", "clarke_gym")
    for option in root.findall("option"):
        _write(option, spec.option)
    _write_bodies(root, spec)
    for element, tendon in _pairs(root.findall("tendon/*"), spec.tendons):
        for part, wrap in _pairs(element, tendon.path):
            if part.tag == "joint":
                part.set("coef", repr(float(wrap.coef)))
    for element, actuator in _pairs(root.findall("actuator/*"), spec.actuators):
        _write(element, actuator)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _write_bodies(root: ET.Element, spec: Any) -> None:
    world = root.find("worldbody")
    assert world is not None
    todo = [(world, spec.worldbody)]
    while todo:
        element, body = todo.pop()
        for tag, parts in (("geom", body.geoms), ("joint", body.joints), ("site", body.sites)):
            for part, described in _pairs(element.findall(tag), parts):
                _write(part, described)
        for child, below in _pairs(element.findall("body"), body.bodies):
            _write(child, below)
            if (inertial := child.find("inertial")) is not None:
                _write(inertial, below)
            todo.append((child, below))


def _pairs(elements: Iterable[ET.Element], described: Iterable[Any]) -> Iterable[Any]:
    return zip(elements, described, strict=True)


def _write(element: ET.Element, described: Any) -> None:
    """Write the numbers that an element shows in full."""
    for name, described_as in _EXACT[element.tag].items():
        if (shown := element.get(name)) is not None:
            count = len(shown.split())
            numbers = np.atleast_1d(getattr(described, described_as))[:count]
            element.set(name, " ".join(repr(float(number)) for number in numbers))


def export_mjcf(
    robot: str | Mapping[str, Any] | Robot,
    path: str | Path,
    *,
    folded: bool = False,
    **options: Any,
) -> Path:
    """Write the MuJoCo model of a robot as an MJCF file that other programs load.

    The actuator of a tendon takes the rate of its commanded length [m/s] as its control; the
    commanded length itself [m], less than 0 when the tendon is pulled in, is its activation
    (``data.act``). Pretension T_0 means that a robot at rest starts at ``data.act = length_0 -
    T_0 / k``. Tensions are ``-data.actuator_force`` [N]; they are never negative.

    Parameters
    ----------
    robot : str, mapping or Robot
        A preset's name, the path of a YAML file, what it holds, or a robot.
    path : str or Path
        Where to write; an existing file is replaced.
    folded : bool
        Whether two virtual tendons stand for the n taut ones of a segment.
    **options
        As in `mjcf`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError, TypeError
        If a choice is unknown or a number impossible.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile, mujoco, clarke_gym
    >>> robot = clarke_gym.Robot((clarke_gym.Segment(n_tendons=5),))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = clarke_gym.export_mjcf(robot, f"{folder}/arm.xml")
    ...     model = mujoco.MjModel.from_xml_path(str(path))
    >>> model.ntendon, model.nu
    (5, 5)
    """
    path = Path(path)
    text = mjcf(robot, folded=folded, **options)
    handle, part = tempfile.mkstemp(prefix=path.name, suffix=".tmp", dir=path.parent)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(part).chmod(0o644)
        Path(part).replace(path)
    except BaseException:
        Path(part).unlink(missing_ok=True)
        raise
    return path
