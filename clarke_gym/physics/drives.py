"""The drives between commands and tendons: a first-order lag, limited in speed."""

from __future__ import annotations

import math

import numpy as np

from clarke_gym.numerics.arrays import Number
from clarke_gym.numerics.batch import added, difference, shortened, times
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector


class Drives:
    r"""Drives that follow their commands with a time constant tau.

    One control period of length T closes the gap by the exact factor :math:`1 - e^{-T/\tau}`; ideal
    drives (tau = 0) close it at once.

    Parameters
    ----------
    robot : Robot
    control_dt : float
        Control period T [s].
    limited : bool
        Whether a drive moves no faster than its speed limit, however far away its command is.

    Examples
    --------
    >>> drives = Drives(Robot(), 0.05)
    >>> held, command = (JointVector([x, 0.0]) for x in (0.0, 1.0))
    >>> [round(part, 6) for part in drives.approach(held, command).parts]
    [0.632121, 0.0]
    """

    def __init__(self, robot: Robot, control_dt: float, limited: bool = False) -> None:
        tau = robot.actuator_time_constant_s
        self._gain = 1.0 if tau == 0.0 else -math.expm1(-control_dt / tau)
        reach = robot.tendon_speeds * control_dt
        # Environments mostly keep to the rate limit; the margin leaves such commands' bits alone.
        reach = reach * (1.0 + 1e-9) if limited else np.full_like(reach, math.inf)
        # With the place of a segment's first component.
        self._reach = list(zip(range(0, 2 * len(reach), 2), reach.tolist(), strict=True))

    def approach(self, held: JointVector, command: JointVector) -> JointVector:
        """Return where the drives get to within one control period.

        Parameters
        ----------
        held : JointVector
            Where they are [m].
        command : JointVector
            Where they are sent [m].

        Returns
        -------
        JointVector
        """
        gain, starts, ends = self._gain, held.parts, command.parts
        parts: list[Number] = []
        for i, reach in self._reach:
            x, y = starts[i], starts[i + 1]
            u, v = gain * (ends[i] - x), gain * (ends[i + 1] - y)
            if reach != math.inf:
                u, v = shortened(u, v, reach)
            parts += x + u, y + v
        off, target = held.off_manifold, command.off_manifold
        if off is not None or target is not None:
            off = added(times(difference(target, off), gain), off)
        return JointVector(parts, off)
