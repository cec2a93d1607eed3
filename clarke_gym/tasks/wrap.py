"""Wrap: wind round a cylinder and keep it against a pull."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_choice
from clarke_gym.physics.base import RobotState, hull_radius
from clarke_gym.robots import Robot
from clarke_gym.robots.scene import Capsule, Scene
from clarke_gym.robots.stiffness import bending_stiffness
from clarke_gym.tasks.base import Metric, Outcome, Task, register_task
from clarke_gym.tasks.shaped import REWARDS

POINTS = 12
"""Points a segment at which the winding is looked at."""

RADIUS = np.array([0.06, 0.1])
"""Smallest and largest radius of the cylinder, over the robot's length."""

HEIGHT = np.array([0.25, 0.4])
"""Lowest and highest place of its axis, over the length."""

GAP = 0.5
"""Gap between straight robot and cylinder, over the robot's radius."""

EASIEST, HARDEST = 1.5, 3.5
"""Winding that is a success [rad], at difficulty 0 and 1."""

NEAR = 1.0
"""Gap at which a point's winding counts by half, over the robot's radius."""

WEAKEST, STRONGEST = 0.2, 1.2
"""Pull on the tip over E I / l^2, at difficulty 0 and 1."""

PULL_S = 3.0
"""Time at which the pull begins [s]."""


@register_task("wrap")
class Wrap(Task):
    r"""Wind round a cylinder, and stay there when the tip is pulled away from it.

    A horizontal cylinder of random radius (0.06 to 0.1 of the length), height and direction lies
    beside the straight robot. Along the backbone each step d alpha of the angle at which the
    cylinder's axis sees it counts by :math:`1/(1+(g/r)^2)` with the gap g between hull and
    cylinder and the hull's radius r; their sum is the wound angle. After 3 s a force pulls the tip
    straight away from the axis.

    The dense reward is the wound angle over the one that is a success (1.5 to 3.5 rad by
    difficulty), at most 1. Success is to have it at that step; an episode's score is the angle at
    its end, and its slip is what was lost of the largest.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard": more winding and a stronger pull are hard.
    """

    sensors: ClassVar[tuple[str, ...]] = (
        "command",
        "displacement",
        "tip_position",
        "clearance",
        "contact_force",
        "obstacles",
    )
    needs: ClassVar[tuple[str, ...]] = ("load", "contact_force")
    max_episode_steps = 120

    def __init__(
        self, robot: Robot, *, reward: str = "dense", difficulty: float | str = 0.5
    ) -> None:
        check_choice("reward", reward, REWARDS)
        self.hull_m, self._sparse = hull_radius(robot), reward == "sparse"
        super().__init__(robot, difficulty)
        self.numbers = 3
        length = robot.length_m
        half = 0.5 * length
        axis = Capsule((half, -half, 0.0), (half, half, 0.0), float(RADIUS.mean()) * length)
        self.scene = Scene((axis,), placed=True, resized=True)
        self.metrics = (
            Metric("wound_rad", "wound angle", "rad", 0.0),
            Metric("most_wound_rad", "largest wound angle", "rad", 0.0, over="most"),
            Metric("slip_rad", "slip", "rad", 2.0 * np.pi, over="fall"),
            Metric("contact_force_n", "contact force", "N", 0.0),
        )

    def settle(self) -> None:
        """Derive the winding and the pull from the difficulty."""
        self.target_rad = EASIEST + (HARDEST - EASIEST) * self.difficulty
        softest = min(bending_stiffness(segment) for segment in self.robot.segments)
        share = WEAKEST + (STRONGEST - WEAKEST) * self.difficulty
        self.pull_n = share * softest / self.robot.length_m**2

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return straight starts (R, S, 2), and where cylinders are (R, 7)."""
        length = self.robot.length_m
        radius, height = (
            length * (low + (high - low) * u)
            for (low, high), u in zip((RADIUS, HEIGHT), numbers.T[:2], strict=True)
        )
        angle = 2.0 * np.pi * numbers[:, 2]
        away = radius + (1.0 + GAP) * self.hull_m
        middle = np.stack([away * np.cos(angle), away * np.sin(angle), height], axis=1)
        half = 0.5 * length * np.stack([-np.sin(angle), np.cos(angle), np.zeros_like(angle)], 1)
        start = np.zeros((len(numbers), self.robot.n_segments, 2))
        return start, np.hstack([middle - half, middle + half, radius[:, None]])

    def places(self, parameters: FloatArray) -> FloatArray:
        """Return where the cylinders are (R, 1, 7)."""
        return parameters[:, None]

    def force(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the pulls [N]: horizontal, back to the side that the robot stands on."""
        middle = 0.5 * (parameters[:, :3] + parameters[:, 3:6])
        back = -middle * (1.0, 1.0, 0.0)
        back /= np.linalg.norm(back, axis=1, keepdims=True)
        return (self.pull_n * (time_s >= PULL_S - 1e-9))[:, None] * back

    def wound(self, state: RobotState) -> FloatArray:
        """Return the wound angles [rad], shape (B,)."""
        curve, body = state.backbone(POINTS), state.bodies[:, 0]
        middle, axis = 0.5 * (body[:, :3] + body[:, 3:6]), body[:, 3:6] - body[:, :3]
        axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
        out = np.stack([-axis[:, 1], axis[:, 0], np.zeros(len(axis))], axis=1)
        gap = curve - middle[:, None]
        x, y = np.vecdot(gap, out[:, None]), gap[..., 2]
        # From the side that the robot stands on the angle grows over the top and down behind.
        turned = np.unwrap(np.arctan2(y, x), axis=1)
        room = np.hypot(x, y) - body[:, 6, None] - self.hull_m
        room = np.maximum(0.5 * (room[:, 1:] + room[:, :-1]), 0.0) / (NEAR * self.hull_m)
        steps, weights = np.diff(turned, axis=1), 1.0 / (1.0 + room**2)
        # A running sum has the same bits for one robot and for many.
        wound: FloatArray = np.abs(np.cumsum(steps * weights, axis=1)[:, -1])
        return wound

    def evaluate(self, state: RobotState, goal: FloatArray) -> Outcome:
        """Return the outcome of how far the robots are wound."""
        del goal
        wound = state.once("wound", self.wound)
        success = wound >= self.target_rad
        share = np.minimum(wound / self.target_rad, 1.0)
        return Outcome(
            reward=success.astype(np.float64) - 1.0 if self._sparse else share,
            success=success,
            metrics={
                "wound_rad": wound,
                "most_wound_rad": wound,
                "slip_rad": wound,
                "contact_force_n": state.contact_force,
            },
            terms={"wound": share},
        )
