"""Several disturbances under one name, and how combinations are written."""

from __future__ import annotations

from typing import Any

from clarke_gym.disturbances.base import DISTURBANCES, Disturbance
from clarke_gym.numerics.registry import nearest
from clarke_gym.robots.robot import Robot

_EVERYDAY = {
    "backlash": 1.0,
    "friction": 1.0,
    "misplacement": 1.0,
    "sensor_noise": 1.0,
    "sensor_bias": 1.0,
    "payload": 1.0,
    "push": 1.0,
    "backbone_stiffness": 1.0,
    "damping": 1.0,
    "base_tilt": 1.0,
}

PRESETS: dict[str, dict[str, float]] = {
    "none": {},
    "mild": dict.fromkeys(_EVERYDAY, 0.25),
    # The identified robot: holes up to 8 degrees off, play of a few tenths of a millimetre, sensors
    # of 15 um steps over 10 mm, a base that is not upright to a few degrees, tendons and a
    # transmission that give by a stiffness ratio up to 0.30, and a pretension of which 0.77 to all
    # is lost. Friction has not been identified apart from play: `friction` stands for both.
    "hardware": {
        "misplacement": 1.0,
        "backlash": 0.6,
        "friction": 0.5,
        "sensor_noise": 0.1,
        "quantisation": 0.08,
        "command_delay": 0.5,
        "backbone_stiffness": 0.5,
        "damping": 0.5,
        "base_tilt": 0.15,
        "tendon_stiffness": 1.0,
        "pretension": 1.0,
    },
    "harsh": {**_EVERYDAY, "unequal_radii": 1.0, "command_delay": 1.0, "slack_tendon": 1.0},
}
"""Strength of each disturbance of a preset."""

DISTURBANCES.reserve(PRESETS)


def parse(text: str | None, physics: str) -> dict[str, float]:
    """Return the disturbances of a combination, with their strengths.

    Parameters
    ----------
    text : str or None
        Names with "+" between them, each of a disturbance or a preset and, where it is not 1, with
        a strength: "payload=0.5+push". They act in this order: noise before quantisation comes in
        steps. One that is named twice is as strong as the last one says.
    physics : str
        Presets leave out what has no meaning there.

    Returns
    -------
    dict of str to float

    Raises
    ------
    ValueError, TypeError
        If a name is unknown, a strength is impossible, or a disturbance that is named has no
        meaning in the physics.

    Examples
    --------
    >>> parse("backlash=0.5+sensor_noise", "constant_curvature")
    {'backlash': 0.5, 'sensor_noise': 1.0}
    """
    if text is not None and not isinstance(text, str):
        raise TypeError(f"disturbances must be a text such as 'payload+push', got {text!r}")
    strengths: dict[str, float] = {}
    for part in (text or "none").split("+"):
        name, given, number = (word.strip() for word in part.partition("="))
        strength = _strength(name, number) if given else 1.0
        if name in PRESETS:
            for key, share in PRESETS[name].items():
                if DISTURBANCES[key].fits(physics):
                    strengths[key] = _possible(key, share * strength, part)
            continue
        if name not in DISTURBANCES:
            names = [*PRESETS, *DISTURBANCES.names()]
            raise ValueError(f"disturbances must be of {names}, got {name!r}{nearest(name, names)}")
        if not DISTURBANCES[name].fits(physics):
            having = list(DISTURBANCES[name].physics)
            raise ValueError(
                f"disturbance {name!r} has no meaning with physics={physics!r}; {having} have it"
            )
        strengths[name] = _possible(name, strength, part)
    return strengths


def _strength(name: str, text: str) -> float:
    try:
        strength = float(text)
    except ValueError:
        strength = -1.0
    if not 0.0 < strength <= 10.0:
        raise ValueError(f"strength of {name!r} must be a number above 0, at most 10, got {text!r}")
    return strength


def _possible(name: str, strength: float, part: str) -> float:
    """Return the strength of a disturbance, which leaves a robot that there can be."""
    most = DISTURBANCES[name].strongest
    if strength > most:
        raise ValueError(
            f"strength of {name!r} must be at most {most:g}, beyond which there is no such robot; "
            f"got {part.strip()!r}, which makes it {strength:g}"
        )
    return strength


def make_disturbances(
    strengths: dict[str, float], robot: Robot, num_envs: int, physics: str
) -> list[Any]:
    """Return disturbances by name, each with its strength.

    Parameters
    ----------
    strengths : dict of str to float
        As `parse` returns them.
    robot : Robot
        The nominal one.
    num_envs : int
    physics : str
        Whose robots they disturb.

    Returns
    -------
    list of Disturbance

    Examples
    --------
    >>> [type(d).__name__ for d in make_disturbances({"payload": 0.5}, Robot(), 1, "mujoco")]
    ['Payload']
    """
    made: list[Disturbance] = []
    for name, strength in strengths.items():
        owner = DISTURBANCES[name]
        owner = owner.twins.get(physics, owner)
        # One that takes no strength is as strong as it is.
        made.append(owner(robot, num_envs) if strength == 1.0 else owner(robot, num_envs, strength))
    return made
