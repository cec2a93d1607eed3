"""Which robots can be simulated: those that their tendons can bend and their loads do not crush."""

from __future__ import annotations

from clarke_gym.physics.mujoco.model import STANDARD_GRAVITY_M_S2
from clarke_gym.physics.statics import taut_gain
from clarke_gym.robots import Robot
from clarke_gym.robots.stiffness import bending_stiffness

LEAST_GAIN = 0.1
"""Smallest bend over the one that tendons are told, at which they still bend a robot."""

MOST_LOADS = 10.0
"""Heaviest load over E I / l^2, under which a backbone buckles."""


def check_possible(robot: Robot, payload_kg: float) -> None:
    """Refuse robots that their tendons cannot bend, and loads that crush them.

    Parameters
    ----------
    robot : Robot
    payload_kg : float
        Point mass at the tip.

    Raises
    ------
    ValueError
        With the numbers.

    Examples
    --------
    >>> check_possible(Robot(), 0.0)
    """
    for k, segment in enumerate(robot.segments, 1):
        gain = taut_gain(segment)
        if gain < LEAST_GAIN:
            raise ValueError(
                f"segment {k}: tendons of pitch_radius_m={segment.pitch_radius_m:g} and stiffness "
                f"{segment.tendon_stiffness_n_m:g} N/m bend a backbone of diameter "
                f"{segment.backbone_diameter_m:g} m by {100.0 * gain:.3g} % of what they are told; "
                f"at least {100.0 * LEAST_GAIN:g} % is a robot"
            )
    softest = min(bending_stiffness(segment) for segment in robot.segments)
    most = MOST_LOADS * softest / robot.length_m**2 / abs(STANDARD_GRAVITY_M_S2[2])
    disks_kg = sum(segment.n_disks * segment.disk_mass_kg for segment in robot.segments)
    if payload_kg + disks_kg > most:
        raise ValueError(
            f"payload_kg={payload_kg!r} and disks of {disks_kg:.3g} kg are more than this robot "
            f"can be simulated under: at most {most:.3g} kg, {MOST_LOADS:g} times what E I / l^2 "
            f"weighs"
        )
