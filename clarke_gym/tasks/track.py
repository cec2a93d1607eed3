"""Track: follow a target that moves."""

from __future__ import annotations

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_choice
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Goal, Metric, Outcome, register_task
from clarke_gym.tasks.paths import PATHS
from clarke_gym.tasks.shaped import ShapedTask, error_metrics

LONGEST_S = 60.0
"""Time after which a path stands still [s]."""

SLOWEST, FASTEST = 0.1, 0.9
"""Largest speed of the target over that of the tendons, at difficulty 0 and 1."""


@register_task("track")
class Track(ShapedTask):
    r"""Follow a moving target with the tip.

    The target is the tip of a shape that moves along a path: a circle, a Lissajous curve, a
    band-limited random path, or straight runs with a random turn every 0.7 s (the randomly turning
    target of soft-arm benchmarks). Its largest speed is a share of the tendons', 0.1 + 0.8 x
    difficulty; the random path and Lissajous curves are slower most of the time. An episode begins
    with the tip on the target.

    The error is the distance e between tip and target; its scale s is a tenth of the length. The
    dense reward is :math:`\frac12/(1 + e/s) + \frac12\exp(-(e/\epsilon)^2)`. A step is a success
    where e is within the tolerance; an episode's score is the share of such steps.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    path : {"circle", "lissajous", "random", "turns"}
        What the target follows.
    success_tolerance : float
        Tolerance epsilon, as a fraction of the robot's length.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard".
    """

    sensors = ("command", "displacement", "tip_position", "preview")
    max_episode_steps = 100
    previews = 2

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        path: str = "random",
        success_tolerance: float = 0.05,
        difficulty: float | str = 0.5,
    ) -> None:
        check_choice("path", path, tuple(PATHS))
        super().__init__(robot, reward, success_tolerance, difficulty, random_start=True)
        self.path = PATHS[path](robot, LONGEST_S)
        self.numbers = self.path.numbers
        self.goal = Goal(("x", "y", "z"), "m", robot.length_m)
        self.metrics = (
            Metric("on_target", "time on target", "", 0.0, over="mean"),
            Metric("tip_error_rms_m", "tip error, RMS", "m", 2.0 * robot.length_m, over="rms"),
            *error_metrics(robot.length_m),
        )

    @property
    def speed_share(self) -> float:
        """Largest speed of the target over that of the tendons."""
        return SLOWEST + (FASTEST - SLOWEST) * self.difficulty

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2), and what tells paths (R, p)."""
        told = self.path.make(numbers, self.speed_share)
        return self.path.at(told, np.zeros(len(told))), told

    def advance(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return target positions [m] (B, 3)."""
        return self.predicted(self.path.at(parameters, time_s))

    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of tip and target positions [m], both (B, 3)."""
        outcome = super().score(achieved, desired)
        error, on_target = outcome.metrics["tip_error_m"], outcome.success.astype(np.float64)
        outcome.metrics = {"on_target": on_target, "tip_error_rms_m": error, **outcome.metrics}
        return outcome
