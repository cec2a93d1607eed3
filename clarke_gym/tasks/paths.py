"""Paths of shapes: what a target that moves follows.

A path runs through the bending vectors of all segments, so every target on it is the tip of a shape
that the robot can take, at a share of the speed that its tendons have.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from clarke_gym.kinematics import sample_dome
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots import Robot

WAVES = 3
"""Sine waves a coordinate of a band-limited random path."""

ROOM = 0.9
"""Share of the bending limit that paths keep to."""

TURN_S = 0.7
"""Time between two turns of a path of straight runs [s]."""


class Path(ABC):
    """Shapes of one kind of motion.

    Parameters
    ----------
    robot : Robot
    duration_s : float
        Longest time that is asked for [s].
    """

    numbers: int
    """Uniform numbers that a path is drawn from."""

    def __init__(self, robot: Robot, duration_s: float) -> None:
        self.segments, self.duration_s = robot.n_segments, duration_s
        self.radius = ROOM * robot.max_bending
        # Bending [rad] that tendons at their speed limit change in a second. A segment's tendons
        # take up the bends before it, too, whose speeds add: each in the ratio of its limit.
        passed = np.cumsum(robot.max_bending) / robot.max_bending
        self.speed = robot.tendon_speeds / robot.pitch_radii / passed

    @abstractmethod
    def make(self, numbers: FloatArray, share: float) -> FloatArray:
        """Return what tells paths (R, p), of uniform numbers (R, numbers).

        `share` is the largest speed of a path over that of the tendons.
        """

    @abstractmethod
    def at(self, told: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the bending vectors [rad] (R, S, 2) of R paths at a time each (R,) [s]."""


class Waves(Path):
    """A centre and some sine waves a coordinate: circles, Lissajous curves, random paths."""

    waves = 1

    def at(self, told: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the bending vectors [rad]."""
        # With the paths last, whose many numbers are then beside each other.
        parts = np.ascontiguousarray(told.T)
        parts = parts.reshape(self.segments, 2, 1 + 3 * self.waves, len(told))
        amplitude, rate, phase = (parts[:, :, 1 + k :: 3] for k in range(3))
        swing = amplitude * np.sin(rate * time_s + phase)
        bending: FloatArray = parts[:, :, 0] + swing.sum(2)
        return bending.transpose(2, 0, 1)

    def _told(
        self, centre: FloatArray, amplitude: FloatArray, rate: FloatArray, phase: FloatArray
    ) -> FloatArray:
        waves = np.stack(np.broadcast_arrays(amplitude, rate, phase), -1)
        parts = np.concatenate([centre[..., None], waves.reshape(*centre.shape, -1)], -1)
        return parts.reshape(len(parts), -1)


class Circle(Waves):
    """A circle in each segment's bending: the tip of one segment runs round its dome."""

    def __init__(self, robot: Robot, duration_s: float) -> None:
        super().__init__(robot, duration_s)
        self.numbers = 1 + 4 * self.segments

    def make(self, numbers: FloatArray, share: float) -> FloatArray:
        """Return circles: radius 0.3 to 0.6 of the limit, centres such that they stay inside."""
        u = numbers[:, 1:].reshape(-1, self.segments, 4)
        radius = self.radius * (0.3 + 0.3 * u[..., 0])
        away = (self.radius - radius) * np.sqrt(u[..., 1])
        angle = 2.0 * np.pi * u[..., 2]
        centre = away[..., None] * np.stack([np.cos(angle), np.sin(angle)], -1)
        sense = np.where(numbers[:, 0] < 0.5, -1.0, 1.0)[:, None]
        rate = share * (self.speed / radius).min(-1, keepdims=True) * sense
        phase = 2.0 * np.pi * u[..., 3]
        phases = np.stack([phase + 0.5 * np.pi, phase], -1)[..., None]
        return self._told(
            centre, radius[..., None, None], np.asarray(rate)[:, :, None, None], phases
        )


class Lissajous(Waves):
    """A Lissajous curve in each segment's bending, with the ratio 2 : 1 or 3 : 2."""

    def __init__(self, robot: Robot, duration_s: float) -> None:
        super().__init__(robot, duration_s)
        self.numbers = 1 + 4 * self.segments

    def make(self, numbers: FloatArray, share: float) -> FloatArray:
        """Return curves whose corners are 0.5 to 1 of the limit away."""
        u = numbers[:, 1:].reshape(-1, self.segments, 4)
        ratio = np.where(numbers[:, 0] < 0.5, 2.0, 1.5)[:, None]
        size = self.radius * (0.5 + 0.5 * u[..., 0]) / np.sqrt(2.0)
        rate = share * (self.speed / (size * np.hypot(1.0, ratio))).min(-1, keepdims=True)
        rates = np.stack(np.broadcast_arrays(rate, ratio * rate), -1)
        phases = 2.0 * np.pi * u[..., 1:3]
        centre = np.zeros((*size.shape, 2))
        return self._told(centre, size[..., None, None], rates[..., None], phases[..., None])


class Random(Waves):
    """A band-limited random path: three sine waves a coordinate."""

    waves = WAVES

    def __init__(self, robot: Robot, duration_s: float) -> None:
        super().__init__(robot, duration_s)
        self.numbers = 6 * WAVES * self.segments

    def make(self, numbers: FloatArray, share: float) -> FloatArray:
        """Return paths whose waves together keep to limit and speed."""
        u = numbers.reshape(-1, self.segments, 2, WAVES, 3)
        weight = 0.2 + u[..., 0]
        total = np.sqrt((weight.sum(-1) ** 2).sum(-1))[..., None, None]
        amplitude = self.radius[:, None, None] * weight / total
        slow = 0.3 + 0.7 * u[..., 1]  # frequencies over the highest
        peak = np.sqrt(((amplitude * slow).sum(-1) ** 2).sum(-1))
        highest = share * (self.speed / peak).min(-1)
        rate = highest[:, None, None, None] * slow
        return self._told(np.zeros(u.shape[:3]), amplitude, rate, 2.0 * np.pi * u[..., 2])


class Turns(Path):
    """Straight runs at constant speed with random turns."""

    def __init__(self, robot: Robot, duration_s: float) -> None:
        super().__init__(robot, duration_s)
        self.runs = int(np.ceil(duration_s / TURN_S)) + 1
        self.numbers = (2 + self.runs) * self.segments

    def make(self, numbers: FloatArray, share: float) -> FloatArray:
        """Return the corners: after each run a random direction, inwards where it would leave."""
        u = numbers.reshape(-1, self.segments, 2 + self.runs)
        here = sample_dome(u[..., :2], self.radius)
        stride = np.minimum(share * self.speed * TURN_S, self.radius)  # the centre is within one
        corners = [here]
        for k in range(self.runs):
            angle = 2.0 * np.pi * u[..., 2 + k]
            step = stride[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)
            # A run that would leave turns round; one that would still leave heads for the centre.
            for other in (-step, -stride[:, None] * here / _norm(here)):
                step = np.where(_norm(here + step) > self.radius[:, None], other, step)
            corners.append(here + step)
            here = corners[-1]
        return np.stack(corners, 1).reshape(len(numbers), -1)

    def at(self, told: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the bending vectors [rad]."""
        corners = told.reshape(len(told), self.runs + 1, self.segments, 2)
        place = np.minimum(time_s / TURN_S, self.runs - 1e-9)
        run = place.astype(np.intp)
        rows, along = np.arange(len(told)), (place - run)[:, None, None]
        bending: FloatArray = (1.0 - along) * corners[rows, run] + along * corners[rows, run + 1]
        return bending


def _norm(pairs: FloatArray) -> FloatArray:
    """Return lengths that can be divided by, (..., 1)."""
    return np.maximum(np.hypot(pairs[..., 0], pairs[..., 1]), 1e-12)[..., None]


PATHS: dict[str, type[Path]] = {
    "circle": Circle,
    "lissajous": Lissajous,
    "random": Random,
    "turns": Turns,
}
"""Kinds of path by name."""
