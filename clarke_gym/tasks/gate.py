"""Gate: reach goals behind bars with openings between them."""

from __future__ import annotations

import math

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import hull_radius
from clarke_gym.robots import Robot
from clarke_gym.robots.scene import Capsule, Scene
from clarke_gym.tasks.base import BoolArray, register_task
from clarke_gym.tasks.obstructed import ObstructedTask

CAGE = 0.35
"""Radius of the ring of bars, over the robot's length."""

WIDEST, NARROWEST = 3.0, 1.5
"""Width of the openings over the robot's, at difficulty 0 and 1."""

PITCH = 3.3
"""Distance between the bars' axes over the robot's width, as far as whole bars allow."""

BEYOND = 1.1
"""How far out goals are at least, over what a tip just outside the bars needs."""

CANDIDATES = 12
"""Shapes from which a start and a goal are taken."""

MARGIN = 0.1
"""Gap over the robot's radius that the known way keeps."""

EVENLY = 0.9
"""Bend of a robot that goes through an opening evenly, over a right angle, if it bends so far."""


@register_task("gate")
class Gate(ObstructedTask):
    """Reach a goal position behind bars (structured obstacles).

    Upright bars stand in a ring around the robot, at 0.35 of its length, with openings of 3 to 1.5
    robot widths. Start and goal lie outside the ring, mostly behind different openings: the robot
    must come back through one and out through another. A clear way is known to exist for every
    episode: straighten from the start's shape, bend to the goal's. Where bars are between tip and
    goal, closeness counts the distance over the straight robot's tip.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon, as a fraction of the robot's length; None for the difficulty's: 0.04,
        0.02 and 0.01 at difficulty 0, 0.5 and 1.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard": narrow openings are hard.
    random_start : bool
        Start behind a random opening; straight, inside the ring, otherwise.

    Raises
    ------
    ValueError
        If the robot bends too little to come out of the ring at this difficulty.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float | None = None,
        difficulty: float | str = 0.5,
        random_start: bool = True,
    ) -> None:
        width, ring = 2.0 * hull_radius(robot), CAGE * robot.length_m
        self.n_bars = max(4, math.floor(2.0 * math.pi * ring / (PITCH * width)))
        self._straight = np.array([0.0, 0.0, robot.length_m])
        super().__init__(robot, reward, success_tolerance, difficulty, random_start)
        self.numbers = 4 * CANDIDATES * robot.n_segments + 2

    def settle(self) -> None:
        """Derive the bars from the difficulty."""
        super().settle()
        length, robot_width = self.robot.length_m, 2.0 * self.hull_m
        ring = CAGE * length
        opening = robot_width * (WIDEST + (NARROWEST - WIDEST) * self.difficulty)
        pitch = 2.0 * ring * math.sin(math.pi / self.n_bars)
        self.bar_radius_m = max(0.5 * (pitch - opening), 0.5 * self.hull_m)
        self._check_reach(ring + self.bar_radius_m + self.hull_m)
        angles = 2.0 * math.pi * (np.arange(self.n_bars) + 0.5) / self.n_bars
        bars = [
            Capsule((x, y, -0.1 * length), (x, y, 1.1 * length), self.bar_radius_m)
            for x, y in ring * np.stack([np.cos(angles), np.sin(angles)], 1)
        ]
        self.scene = Scene(tuple(bars), placed=True, resized=True)
        self._ring_m, self._half_opening = ring, math.tan(math.pi / self.n_bars)
        self._outside = BEYOND * (ring + self.bar_radius_m + self.hull_m)

    def _check_reach(self, needed: float) -> None:
        """Refuse a robot whose tip does not get `needed` [m] to the side."""
        most = self.robot.max_bending
        bend = min(EVENLY * 0.5 * np.pi, float(most.sum()))
        self._even = bend * (most / most.sum())
        pairs = np.stack([self._even, np.zeros_like(most)], -1)
        out = float(kinematics.forward(pairs, self.robot.lengths)[0][0])
        if out < needed:
            raise ValueError(
                f"the tip of robot {self.robot.name!r} comes {out:.3g} m to the side and needs "
                f"{needed:.3g} m to get out of Gate's ring of bars at difficulty "
                f"{self.difficulty:g}: it needs larger bending limits (max_bending_rad), got "
                f"{most.tolist()}"
            )

    def places(self, parameters: FloatArray) -> FloatArray:
        """Return the bars, alike for all episodes, shape (R, K, 7)."""
        return np.broadcast_to(self.scene.numbers, (len(parameters), *self.scene.numbers.shape))

    def ways(
        self, achieved: FloatArray, desired: FloatArray, errors: list[FloatArray]
    ) -> list[FloatArray]:
        """Return the distance that is left [m]: by the straight tip, where bars are between."""
        tip, goal = achieved[:, :2], desired[:, :2]
        ahead, flat = np.vecdot(tip, goal), np.vecdot(tip, tip)
        aside = goal[:, 0] * tip[:, 1] - goal[:, 1] * tip[:, 0]
        other, outside = self._half_opening * ahead < np.abs(aside), flat > self._ring_m**2
        up, down = achieved[:, :3] - self._straight, desired[:, :3] - self._straight
        over = np.sqrt(np.vecdot(up, up)) + np.sqrt(np.vecdot(down, down))
        return [np.where(other & outside, over, errors[0])]

    def lay(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return starts (R, S, 2) and goals (R, 4)."""
        segments, rows = self.robot.n_segments, len(numbers)
        uniforms = numbers[:, : 4 * CANDIDATES * segments]
        uniforms = uniforms.reshape(rows, 2, CANDIDATES, segments, 2)
        shapes = kinematics.sample_dome(uniforms, self.robot.max_bending)
        tips = kinematics.forward(shapes, self.robot.lengths)[0]
        good = np.hypot(tips[..., 0], tips[..., 1]) >= self._outside
        # Most ways that bars block are blocked at their ends, which are looked at first.
        good[good] = self._clear(self.curves(shapes[good]))
        good[good] = self._clear(self.leg(np.zeros_like(shapes[good]), shapes[good]))
        # Where no candidate will do, an even bend through the middle of an opening does.
        index = np.floor(numbers[:, -2:] * self.n_bars)
        angle = 2.0 * np.pi * index / self.n_bars
        plain = self._even[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1)[:, :, None, :]
        plain = np.broadcast_to(plain, (rows, 2, segments, 2))
        first = good.argmax(-1)
        picked = np.take_along_axis(shapes, first[..., None, None, None], 2)[:, :, 0]
        chosen = np.where(good.any(-1)[..., None, None], picked, plain)
        start = chosen[:, 0] if self._random_start else np.zeros_like(chosen[:, 0])
        return start, self.tips(chosen[:, 1])

    def _clear(self, points: FloatArray) -> BoolArray:
        """Return whether robots through points (R, P, 3) [m] keep their distance from all bars."""
        clear: BoolArray = self.gaps(points, self.scene.numbers).min(-1) >= MARGIN * self.hull_m
        return clear
