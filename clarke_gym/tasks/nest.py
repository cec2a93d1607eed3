"""Nest: reach goals among random spheres and rods."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.noise import directions
from clarke_gym.robots import Robot
from clarke_gym.robots.scene import Capsule, Scene
from clarke_gym.tasks.base import register_task
from clarke_gym.tasks.obstructed import PARKED, ObstructedTask

SPHERES, RODS = 4, 4
SPHERE_RADIUS, ROD_RADIUS, ROD_LENGTH = 0.06, 0.025, 0.3
"""Over the robot's length."""

FEWEST, MOST = 2, SPHERES + RODS
"""Bodies in play at difficulty 0 and 1."""

CANDIDATES = 6
"""Places from which each body's is taken: the first that leaves the known way clear."""

ROOMIEST, TIGHTEST = 0.6, 0.2
"""Gap over the robot's radius that the known way keeps, at difficulty 0 and 1."""

REACH = np.array([0.4, 1.0])
"""Where along a random shape a body is put, over its length."""


@register_task("nest")
class Nest(ObstructedTask):
    """Reach a goal position in a nest of random obstacles.

    Spheres and rods stand where the robot could be, other ones in every episode: two of them at
    difficulty 0, eight at 1. They leave a way clear, but for grazing, that is known to exist, from
    the start by a random shape to the goal; the straight way may be blocked. Bodies for which there
    is no such place lie out of reach, below the base.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon, as a fraction of the robot's length; None for the difficulty's: 0.04,
        0.02 and 0.01 at difficulty 0, 0.5 and 1.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard": more bodies and less room are hard.
    random_start : bool
        Start from a random shape; straight otherwise.
    """

    sensors: ClassVar[tuple[str, ...]] = (
        "command",
        "displacement",
        "tip_position",
        "clearance",
        "obstacles",
    )

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float | None = None,
        difficulty: float | str = 0.5,
        random_start: bool = True,
    ) -> None:
        super().__init__(robot, reward, success_tolerance, difficulty, random_start)
        length, segments = robot.length_m, robot.n_segments
        self.numbers = 6 * segments + MOST + MOST * CANDIDATES * (2 * segments + 3)
        low = (0.0, 0.0, -PARKED * length)
        high = (0.0, 0.0, (ROD_LENGTH - PARKED) * length)
        spheres = (Capsule(low, low, SPHERE_RADIUS * length),) * SPHERES
        rods = (Capsule(low, high, ROD_RADIUS * length),) * RODS
        self.scene = Scene((*spheres, *rods), placed=True)

    @property
    def n_bodies(self) -> int:
        """Bodies in play."""
        return round(FEWEST + (MOST - FEWEST) * self.difficulty)

    def places(self, parameters: FloatArray) -> FloatArray:
        """Return where the bodies are, shape (R, K, 7)."""
        return parameters[:, 4:].reshape(len(parameters), -1, 7)

    def lay(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return starts (R, S, 2), and goals and bodies (R, 4 + 7 K)."""
        segments, rows = self.robot.n_segments, len(numbers)
        ends, lots, rest = np.split(numbers, [6 * segments, 6 * segments + MOST], axis=1)
        most = self.robot.max_bending
        start, over, goal = np.moveaxis(
            kinematics.sample_dome(ends.reshape(rows, 3, segments, 2), most), 1, 0
        )
        if not self._random_start:
            start = np.zeros_like(start)
        way = np.concatenate([self.leg(start, over), self.leg(over, goal)], 1)
        bodies = self._candidates(rest.reshape(rows, MOST, CANDIDATES, -1))
        drawn = lots.argsort(-1).argsort(-1) < self.n_bodies
        asked = bodies[drawn].reshape(rows, self.n_bodies * CANDIDATES, 7)
        room = ROOMIEST + (TIGHTEST - ROOMIEST) * self.difficulty
        clear = np.zeros((rows, MOST, CANDIDATES), bool)
        clear[drawn] = (self.gaps(way, asked) >= room * self.hull_m).reshape(-1, CANDIDATES)
        first = clear.argmax(-1)[..., None, None]
        picked = np.take_along_axis(bodies, first, 2)[:, :, 0]
        placed = np.where(clear.any(-1, keepdims=True), picked, self.scene.numbers)
        return start, np.hstack([self.tips(goal), placed.reshape(rows, -1)])

    def _candidates(self, numbers: FloatArray) -> FloatArray:
        """Return bodies (R, K, C, 7) around points of random shapes, of numbers (R, K, C, 2 S + 3).

        Their middles are where a backbone could be; rods have any direction.
        """
        pairs = numbers[..., :-3].reshape(*numbers.shape[:-1], self.robot.n_segments, 2)
        shapes = kinematics.sample_dome(pairs, self.robot.max_bending)
        points = 6
        curve = kinematics.backbone(shapes, self.robot.lengths, points)
        count = curve.shape[-2] - 1
        along = REACH[0] + (REACH[1] - REACH[0]) * numbers[..., -3]
        index = np.ceil(along * count).astype(np.intp)
        middle = np.take_along_axis(curve, index[..., None, None], -2)[..., 0, :]
        direction = directions(numbers[..., -2:])
        nominal = self.scene.numbers
        half = 0.5 * np.linalg.norm(nominal[:, 3:6] - nominal[:, :3], axis=1)[:, None, None]
        radius = np.broadcast_to(nominal[:, 6, None, None], (*middle.shape[:-1], 1))
        return np.concatenate([middle - half * direction, middle + half * direction, radius], -1)
