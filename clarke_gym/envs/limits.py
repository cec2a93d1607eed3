"""The physically reachable set of commands: one rule for every representation."""

from __future__ import annotations

from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import Number
from clarke_gym.numerics.batch import Factors, added, bounded, copied, difference, shortened
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector


class CommandLimits:
    """Turns actions into commands that the drives can follow.

    One after the other: the part of an increment on the manifold is saturated radially, segment by
    segment, at the tendons' speed limit; then the resulting bends are at theirs, which can move
    the tendons of later segments further in that step than their speed does. The off-manifold part
    has the speed limit for itself: it is scaled down where it alone would take a tendon beyond
    that, or beyond the co-contraction limit.

    Parameters
    ----------
    robot : Robot
    control : {"increment", "absolute"}
    control_dt : float
        Control period [s].
    """

    def __init__(self, robot: Robot, control: str, control_dt: float) -> None:
        self._absolute = control == "absolute"
        self._off_step = robot.max_tendon_speed_m_s * control_dt
        self._most_off = robot.max_cocontraction_m
        self._radii = robot.pitch_radii.tolist()
        # With the place of a segment's first component, for loops over segments.
        places = range(0, 2 * robot.n_segments, 2)
        self._max_bending = list(zip(places, robot.max_bending.tolist(), strict=True))
        steps = robot.tendon_speeds * control_dt
        scales = robot.max_clarke if self._absolute else steps
        self._off_scales = Factors(np.repeat(scales, robot.n_tendons))
        self._moves = list(zip(places, scales.tolist(), steps.tolist(), strict=True))

    def apply(self, action: JointVector, command: JointVector) -> JointVector:
        """Return the command that follows `command` under an action.

        Parameters
        ----------
        action : JointVector
            1 is the speed limit (increment) or the largest displacement (absolute). Its
            off-manifold numbers are used up: new memory for large batches costs more than sums.
        command : JointVector
            The command held so far [m].

        Returns
        -------
        JointVector
            The new command [m], inside the limits of bends and co-contraction.
        """
        held, asked = command.parts, action.parts
        parts: list[Number] = []
        for i, scale, step in self._moves:
            x, y = held[i], held[i + 1]
            u, v = asked[i] * scale, asked[i + 1] * scale
            if self._absolute:
                u, v = u - x, v - y
            u, v = shortened(u, v, step)
            parts += x + u, y + v
        bends = kinematics.decoupled(parts, self._radii)
        parts = []
        for i, most in self._max_bending:
            parts += shortened(bends[i], bends[i + 1], most)
        off = self._off_manifold(action.off_manifold, command.off_manifold)
        return JointVector(kinematics.coupled(parts, self._radii), off)

    def _off_manifold(self, asked: Any, held: Any) -> Any:
        """Return the off-manifold command [m]."""
        if asked is not None:
            asked = self._off_scales.times(asked)
        if self._absolute and held is not None:
            asked = difference(asked, held)
        if asked is not None:
            asked = added(bounded(asked, self._off_step), held)
        elif held is None:
            return None
        else:  # a row beside others that ask for something goes this way, too
            asked = copied(held)
        return bounded(asked, self._most_off)
