"""Reach: bring the tip to a goal position."""

from __future__ import annotations

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_choice, check_positive
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Goal, GoalTask, Metric, Outcome, register_task

REWARDS = ("dense", "sparse")

MOST_TOLERANCE = 1.0
"""Largest tolerance, as a fraction of the robot's length."""

CLOSENESS_SCALE = 0.1
"""Tip error, as a fraction of the robot's length, at which the closeness term is one half."""


@register_task("reach")
class Reach(GoalTask):
    r"""Reach a goal position with the tip.

    With the tip error e as a fraction of the robot's length the dense reward is the mean of two
    terms in [0, 1]: closeness :math:`1/(1 + e/0.1)`, which has a slope everywhere, and precision
    :math:`\exp(-(e/\epsilon)^2)`, which asks for the last millimetres. The sparse reward is 0 on
    success and -1 otherwise. Success means e <= tolerance.

    Goals of one segment are uniform over the dome of its tip positions. With several segments each
    segment's bend is drawn that way and the goal is the tip of that shape, so it is reachable.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float
        Tolerance epsilon, as a fraction of the robot's length.
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.

    Raises
    ------
    ValueError, TypeError
        If `reward` is unknown, `success_tolerance` is not positive and finite, or `random_start`
        is neither true nor false.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float = 0.02,
        random_start: bool = True,
    ) -> None:
        super().__init__(robot)
        check_choice("reward", reward, REWARDS)
        check_positive("success_tolerance", success_tolerance)
        if success_tolerance > MOST_TOLERANCE:
            raise ValueError(
                f"success_tolerance is a fraction of the length of at most {MOST_TOLERANCE}, got "
                f"{success_tolerance!r}: every tip would be a success"
            )
        if not isinstance(random_start, bool):
            raise TypeError(f"random_start must be true or false, got {random_start!r}")
        self.success_tolerance = float(success_tolerance)
        self.numbers = 4 * robot.n_segments
        self.goal = Goal(("x", "y", "z"), "m", robot.length_m)
        self.metrics = (  # no tip can be further from a goal than twice the length
            Metric("tip_error_m", "tip error", "m", 2.0 * robot.length_m),
            Metric("tip_error_percent", "tip error", "% of length", 200.0),
        )
        self._tolerance_m = self.success_tolerance * robot.length_m
        self._scale_m = CLOSENESS_SCALE * robot.length_m
        self._half_m = 0.5 * self._scale_m
        self._decay = -1.0 / self._tolerance_m**2
        self._percent = 100.0 / robot.length_m
        self._sparse = reward == "sparse"
        self._random_start = random_start

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2) and goal positions [m] (R, 3)."""
        pairs = numbers.reshape(len(numbers), 2, self.robot.n_segments, 2)
        bending = kinematics.sample_dome(pairs, self.robot.max_bending)
        start = bending[:, 0]
        goal, _ = kinematics.forward(bending[:, 1], self.robot.lengths)
        return start if self._random_start else np.zeros_like(start), goal

    def achieved(self, state: RobotState) -> FloatArray:
        """Return the tip position [m]."""
        return state.tip_position

    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of tip positions and goals [m], both (B, 3)."""
        gap = achieved - desired
        square = np.vecdot(gap, gap)
        error = np.sqrt(square)
        success = error <= self._tolerance_m
        closeness = self._half_m / (self._scale_m + error)
        precision = 0.5 * np.exp(np.maximum(square * self._decay, -700.0))  # underflow is slow
        return Outcome(
            reward=success - 1.0 if self._sparse else closeness + precision,
            success=success,
            metrics={"tip_error_m": error, "tip_error_percent": error * self._percent},
            terms={"closeness": closeness, "precision": precision},
        )
