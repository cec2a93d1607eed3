"""Tasks among bodies that a robot must not touch."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import ClassVar

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState, hull_radius
from clarke_gym.robots import Robot
from clarke_gym.robots.scene import body_distance
from clarke_gym.tasks.base import Goal, Metric, Outcome
from clarke_gym.tasks.shaped import CostedTask, error_metrics

TOUCH_SHARE = 0.1
"""Depth over the robot's radius that still counts as touching, not as being inside."""

APART = 2.0
"""How far apart the places are, over the hull's radius, at which a motion that is known to be clear
is looked at: along the backbone, and along the way of the tip. Between them it may graze."""

MOST_SHAPES, MOST_POINTS = 32, 16
"""Shapes a leg and points a segment at most: robots that are thinner still are looked at no finer,
as the cost grows with both."""

PARKED = 1.5
"""How far below the base a body that is not in play lies, over the robot's length."""

CHUNK = 64
"""Episodes that are prepared at once: what they need grows with their number."""


class ObstructedTask(CostedTask):
    r"""Reach a goal position among bodies.

    The error is the distance e between tip and goal; its scale s is a tenth of the length. With the
    depth c by which the robot's hull is inside a body (a negative `RobotState.clearance`), over the
    hull's radius, the dense reward is
    :math:`(1-c)\left(\frac12/(1+e/s)+\frac12\exp(-(e/\epsilon)^2)\right)`. Where c passes 1 the
    episode ends as a failure: constant curvature goes through bodies, MuJoCo's contact holds the
    robot well before. Success also asks that it only touches: c is at most 0.1.

    The depth is a part of achieved goals, as a fourth number that is to be zero, so that rewards of
    hindsight replay are those of the episode.
    """

    sensors: ClassVar[tuple[str, ...]] = ("command", "displacement", "tip_position", "clearance")
    max_episode_steps = 100
    prepared = 4

    def __init__(
        self,
        robot: Robot,
        reward: str,
        success_tolerance: float | None,
        difficulty: float | str,
        random_start: bool,
    ) -> None:
        self.hull_m = hull_radius(robot)
        lengths, apart = robot.lengths, APART * self.hull_m
        # What a segment's bend moves the tip by: itself by half its length, the rest by the rest.
        arms = np.cumsum(lengths[::-1])[::-1] - 0.5 * lengths
        shapes = 1 + math.ceil((2.0 * robot.max_bending * arms).sum() / apart)
        self._path_shapes = min(shapes, MOST_SHAPES)
        self._path_points = min(math.ceil(lengths.max() / apart), MOST_POINTS)
        super().__init__(robot, reward, success_tolerance, difficulty, random_start)
        self.goal = Goal(("x", "y", "z", "depth"), "m", robot.length_m, costs=1)
        self.metrics = (
            *error_metrics(robot.length_m),
            Metric("clearance_m", "clearance", "m", -self.hull_m),
            Metric("least_clearance_m", "least clearance", "m", -self.hull_m, over="least"),
        )

    def achieved(self, state: RobotState) -> FloatArray:
        """Return the tip position and the depth inside a body [m]."""
        depth = (-state.clearance).clip(0.0, 2.0 * self.hull_m)
        return np.concatenate([state.tip_position, depth[:, None]], axis=1)

    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of positions and depths [m], both (B, 4)."""
        outcome = super().score(achieved, desired)
        # Whatever depth a goal in hindsight has: none is wanted.
        depth = achieved[:, 3] / self.hull_m
        outcome.success = outcome.success & (depth <= TOUCH_SHARE)
        free = 1.0 - np.minimum(depth, 1.0)
        outcome.terms = {name: free * term for name, term in outcome.terms.items()}
        if self._sparse:
            outcome.reward = outcome.success.astype(np.float64) - 1.0
        else:
            outcome.reward = outcome.terms["closeness"] + outcome.terms["precision"]
        outcome.failure = depth > 1.0
        return outcome

    def evaluate(self, state: RobotState, goal: FloatArray) -> Outcome:
        """Return the outcome of what is achieved, with the clearance."""
        outcome = super().evaluate(state, goal)
        clearance = np.minimum(state.clearance, self.robot.length_m)
        outcome.metrics = {
            **outcome.metrics,
            "clearance_m": clearance,
            "least_clearance_m": clearance,
        }
        return outcome

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2), and goals and bodies (R, p)."""
        parts = [self.lay(numbers[k : k + CHUNK]) for k in range(0, len(numbers), CHUNK)]
        starts, parameters = (np.concatenate(part) for part in zip(*parts, strict=True))
        return starts, parameters

    @abstractmethod
    def lay(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return starts and parameters of some episodes; parameters begin with goals (R, 4)."""

    def leg(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return points of the backbone on the straight way between shapes (..., S, 2) [rad].

        Returns
        -------
        ndarray, shape (..., K, 3)
            [m].
        """
        share = np.linspace(0.0, 1.0, self._path_shapes)[:, None, None]
        shapes = start[..., None, :, :] * (1.0 - share) + end[..., None, :, :] * share
        curves = self.curves(shapes)
        return curves.reshape(*start.shape[:-2], self._path_shapes * curves.shape[-2], 3)

    def curves(self, shapes: FloatArray) -> FloatArray:
        """Return points of the backbone of shapes (..., S, 2) [rad], (..., P, 3) [m]."""
        return kinematics.backbone(shapes, self.robot.lengths, self._path_points)

    def tips(self, shapes: FloatArray) -> FloatArray:
        """Return goals (R, 4) of goal shapes (R, S, 2) [rad]."""
        position = self.predicted(shapes)
        return np.hstack([position, np.zeros((len(position), 1))])

    def gaps(self, points: FloatArray, bodies: FloatArray) -> FloatArray:
        """Return the smallest gaps of hulls around points (..., P, 3) to bodies (..., K, 7)."""
        gaps: FloatArray = body_distance(points, bodies) - self.hull_m
        return gaps
