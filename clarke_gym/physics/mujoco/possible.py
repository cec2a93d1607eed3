"""Which robots can be simulated: those that their tendons can bend and their loads do not crush."""

from __future__ import annotations

from clarke_gym.numerics.checks import check_not_negative
from clarke_gym.physics.statics import most_payload_kg, taut_gain
from clarke_gym.robots import Robot

LEAST_GAIN = 0.1
"""Smallest bend over the one that tendons are told, at which they still bend a robot."""


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
    check_not_negative("payload_kg", payload_kg)
    for k, segment in enumerate(robot.segments, 1):
        gain = taut_gain(segment)
        if gain < LEAST_GAIN:
            raise ValueError(
                f"segment {k}: tendons of pitch_radius_m={segment.pitch_radius_m:g} and stiffness "
                f"{segment.tendon_stiffness_n_m:g} N/m bend a backbone of diameter "
                f"{segment.backbone_diameter_m:g} m by {100.0 * gain:.3g} % of what they are told; "
                f"at least {100.0 * LEAST_GAIN:g} % is a robot"
            )
    most = most_payload_kg(robot)
    if most < 0.0:
        raise ValueError(
            f"disks and backbone of this robot of {robot.length_m:g} m are by {-most:.3g} kg more "
            "than it is likely to be simulated under"
        )
    if payload_kg > most:
        raise ValueError(
            f"payload_kg={payload_kg!r} is more than this robot can be simulated under: at most "
            f"{most:.3g} kg"
        )
