"""Tendons that are not where the nominal robot has them."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.disturbances.base import Disturbance, Simulated, register_disturbance
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots.robot import Robot

MOST_ANGLE_RAD = math.radians(8.0)
"""Largest misplacement of a hole around the backbone; the identified robot's are up to 8 deg."""

MOST_RADIUS_SHARE = 0.05
"""Largest misplacement of a hole along the radius, over it."""

MOST_UNEQUAL = 0.2
"""Largest difference of a tendon's radius from the nominal one, over it."""

MOST_TURN_RAD = math.pi / 2
"""Most that helical tendons turn around a segment."""


class OtherLayout(Disturbance):
    r"""A robot whose tendons run elsewhere than everybody thinks.

    With the decoder D of the nominal layout and D' of the true one, taut tendons commanded to
    :math:`\rho` leave the true robot in the shape :math:`s = D'^+\rho` and strained by
    :math:`\rho - D's`. Physics is given the nominal robot's command to the same end,
    :math:`Ds + (I-P)(\rho - D's)`: the same shape, and of the strains what is off its manifold.
    What sensors tell of displacements is that of the nominal layout.
    """

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        joints, shape = robot.n_joints, (num_envs, robot.n_joints, robot.n_joints)
        self.psi = np.concatenate([segment.angles for segment in robot.segments])
        self.radii = np.concatenate([segment.radii for segment in robot.segments])
        self._nominal = np.repeat(robot.pitch_radii, robot.n_tendons)
        self._owner = np.repeat(np.arange(robot.n_segments), robot.n_tendons)
        self._map = np.broadcast_to(np.eye(joints), shape).copy()

    @abstractmethod
    def layout(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angles [rad] and radii [m] of the true tendons, both (R, N); 0 for none."""

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Derive the maps of the episodes' layouts."""
        del command
        self._map[rows] = self._maps(numbers)

    def decoders(self, numbers: FloatArray) -> FloatArray:
        """Return the true decoders D', (R, N, 2S): displacements per Clarke coordinates."""
        angles, radii = self.layout(numbers)
        own = (radii / self._nominal)[..., None] * np.stack([np.cos(angles), np.sin(angles)], -1)
        decoder = np.zeros((len(numbers), self.robot.n_joints, 2 * self.robot.n_segments))
        for k in range(self.robot.n_segments):
            mine = self._owner == k
            decoder[:, mine, 2 * k : 2 * k + 2] = own[:, mine]
        return decoder

    def _maps(self, numbers: FloatArray) -> FloatArray:
        decoder = self.decoders(numbers)
        inverse = np.linalg.pinv(decoder)
        nominal, eye = self.robot.decoder, np.eye(self.robot.n_joints)
        off = eye - nominal @ self.robot.encoder
        return nominal @ inverse + off @ (eye - decoder @ inverse)

    def step(self, command: FloatArray) -> FloatArray:
        """Return the nominal robot's command to the same end [m]."""
        told: FloatArray = np.matvec(self._map, command)
        return told

    def get_state(self) -> dict[str, Any]:
        """Return nothing: the maps follow from what was drawn."""
        return {}

    def set_state(self, state: dict[str, Any]) -> None:
        """Derive the maps again."""
        del state
        self._map[:] = self._maps(self.drawn)


class _PerTendon(OtherLayout):
    count: ClassVar[int]

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        self.numbers = self.hidden = robot.n_joints * self.count  # type: ignore[misc]
        super().__init__(robot, num_envs, strength)


@register_disturbance("misplacement")
class Misplacement(_PerTendon):
    """Holes are up to 8 degrees and 5 % of the radius away, drawn for every episode."""

    count: ClassVar[int] = 2

    def layout(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the true angles [rad] and radii [m]."""
        turn, away = np.split(self.strength * (2.0 * numbers - 1.0), 2, axis=1)
        return self.psi + MOST_ANGLE_RAD * turn, self.radii * (1.0 + MOST_RADIUS_SHARE * away)


@register_disturbance("unequal_radii")
class UnequalRadii(_PerTendon):
    """Tendons are up to a fifth nearer to the backbone, or farther, drawn for every episode."""

    strongest: ClassVar[float] = 0.9 / MOST_UNEQUAL
    count: ClassVar[int] = 1

    def layout(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the true angles [rad] and radii [m]."""
        away = MOST_UNEQUAL * self.strength * (2.0 * numbers - 1.0)
        return np.broadcast_to(self.psi, numbers.shape), self.radii * (1.0 + away)


class _Wound(Simulated):
    name: ClassVar[str] = "helical"

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return the turns a segment [rad]."""
        return {"turn_rad": _turn(self.strength, numbers[:, 0])}


def _turn(strength: float, numbers: FloatArray) -> FloatArray:
    """Return by what helical tendons turn along a segment [rad]."""
    turn: FloatArray = MOST_TURN_RAD * strength * (2.0 * numbers - 1.0)
    return turn


@register_disturbance("helical")
class Helical(OtherLayout):
    r"""Tendons wind round the backbone, by a turn tau a segment drawn for every episode.

    In MuJoCo they pull where they are: without other loads the bend turns along with them, and its
    sum over a segment is :math:`\mathrm{sinc}(\tau/2)` of the parallel tendons', turned by tau/2.
    The moment by which helical tendons twist the backbone is left out.

    In constant curvature the tendon at :math:`\psi + \tau s/l` is displaced along an arc of bend
    phi by :math:`d\,\phi\,\mathrm{sinc}(\tau/2)\cos(\psi + \tau/2 - \theta)`, the mean over the
    segment: as parallel tendons turned by tau/2 on a smaller radius. Segments further out find them
    turned by tau for each one passed. That the true backbone leaves the arc is not simulated, so
    the bend is :math:`1/\mathrm{sinc}(\tau/2)` of the parallel tendons', not
    :math:`\mathrm{sinc}(\tau/2)`.
    """

    strongest: ClassVar[float] = 3.0  # at 4 what is displaced around a full turn cancels
    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1
    twins: ClassVar[Mapping[str, type[Disturbance]]] = {"mujoco": _Wound}

    def layout(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the parallel tendons that do the same in the first segment: angles and radii."""
        turn = _turn(self.strength, numbers)
        return self.psi + 0.5 * turn, self.radii * np.sinc(turn / (2.0 * np.pi))

    def decoders(self, numbers: FloatArray) -> FloatArray:
        """Return the true decoders: the segments that a tendon passes find it turned further."""
        turn = _turn(self.strength, numbers)
        angles, radii = self.layout(numbers)
        decoder = np.zeros((len(numbers), self.robot.n_joints, 2 * self.robot.n_segments))
        for k in range(self.robot.n_segments):
            # Of a displacement by the bend of segment k, of which Clarke coordinates are the sums.
            passing, ends = self._owner >= k, 2 * (k + 1)
            here = angles + k * turn
            own = np.stack([np.cos(here), np.sin(here)], -1) * radii[..., None]
            own = np.where(passing[:, None], own, 0.0) / self.robot.pitch_radii[k]
            decoder[:, :, ends - 2 : ends] += own
            if k:
                previous = self.robot.pitch_radii[k] / self.robot.pitch_radii[k - 1]
                decoder[:, :, ends - 4 : ends - 2] -= previous * own
        return decoder


class _Broken(Simulated):
    name: ClassVar[str] = "broken_tendon"

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return which tendons are left."""
        return {"intact": np.arange(self.robot.n_joints) != _which(self.robot, numbers)}


def _which(robot: Robot, numbers: FloatArray) -> NDArray[np.intp]:
    """Return which tendon is meant by a uniform number."""
    return (numbers * robot.n_joints).astype(np.intp)


@register_disturbance("broken_tendon")
class BrokenTendon(OtherLayout):
    """One tendon, drawn for every episode, is broken: the others of its segment are left.

    In MuJoCo it carries nothing, and the others can only pull; a step costs what it costs robots
    with a slack tendon. In constant curvature they still push as well as they pull.
    """

    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1
    twins: ClassVar[Mapping[str, type[Disturbance]]] = {"mujoco": _Broken}

    def layout(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the layout without the broken tendon."""
        left = np.arange(self.robot.n_joints) != _which(self.robot, numbers)
        radii = np.where(left, self.radii, 0.0)
        return np.broadcast_to(self.psi, radii.shape), radii
