"""What the simulated tendons are that the nominal ones are not: MuJoCo alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clarke_gym.disturbances.base import Simulated, register_disturbance
from clarke_gym.disturbances.drives import MOST_FRICTION
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.statics import taut_gain
from clarke_gym.robots.robot import Robot

MOST_GIVE = 0.3
"""Largest stiffness ratio (EI/l) / (n k d^2 / 2) added to the nominal one; the identified robot has
0.17 to 0.30 a segment, where its preset has 0.006 to 0.007."""

MOST_LOST = 1.0
"""Largest share of the pretension that is lost; the identified robot has lost 0.77 to all of it."""


@register_disturbance("tendon_stiffness")
class TendonStiffness(Simulated):
    r"""Tendons and transmission give, up to a stiffness ratio of 0.3, drawn for every episode.

    Of what they are told, taut tendons bend a segment by :math:`1/(1 + a)`, with the ratio
    :math:`a = (EI/l)/(nkd^2/2)` of the backbone's stiffness to the tendons' (`taut_gain`): 0.998
    for the default robot, 0.77 at the ratio of 0.3.
    """

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._ratio = np.array([1.0 / taut_gain(segment) - 1.0 for segment in robot.segments])

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return factors, one a segment: as stiff as the ratio is small."""
        return {
            "tendon_stiffness": self._ratio / (self._ratio + MOST_GIVE * self.strength * numbers)
        }


@register_disturbance("pretension")
class Pretension(Simulated):
    """Tendons have lost up to all of their pretension, drawn for every episode."""

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return factors, one a segment."""
        left = np.maximum(1.0 - MOST_LOST * self.strength * numbers, 0.0)
        return {"pretension": np.repeat(left, self.robot.n_segments, axis=1)}


@register_disturbance("capstan")
class Capstan(Simulated):
    r"""Capstan friction in the tendons: it grows with their tension, drawn for every episode.

    Euler and Eytelwein's :math:`T e^{-\mu\varphi}` is what a tension T has left where a tendon that
    is pulled in has passed the angle :math:`\varphi` of the bend phi. Simulated is its mean over
    all angles, one dry friction of up to :math:`T\,(1 - (1 - e^{-\mu\phi})/(\mu\phi))` between each
    tendon and the body: it holds as well as it brakes. T and phi, the sum of the angles of all
    joints that the tendon passes, are those at the start of each control period. Left out are that
    a tendon that is let out loses more, of second order in :math:`\mu\phi`, and what slips along a
    tendon that does not move at its end: a bend to and fro that sums to nothing is not held. All
    tendons are simulated, in short time steps: with seven tendons a step costs fifty times as much.
    """

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return coefficients mu."""
        return {"friction": MOST_FRICTION * self.strength * numbers[:, 0]}
