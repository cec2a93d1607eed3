"""Tasks whose reward is shaped from errors between what is achieved and what is desired."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import add, and_
from typing import NamedTuple

import numpy as np

from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray, constant
from clarke_gym.numerics.checks import check_choice, check_positive
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import GoalTask, Metric, Outcome

REWARDS = ("dense", "sparse")

MOST_TOLERANCE = 1.0
"""Largest tolerance, as a fraction of the robot's length."""

EASIEST_TOLERANCE = 0.04
"""Tolerance at difficulty 0, as a fraction of the robot's length."""

HARDEST_SHARE = 0.25
"""Share of it that is left at difficulty 1; geometric between."""

CLOSENESS_SCALE = 0.1
"""Tip error, as a fraction of the robot's length, at which the closeness term is one half."""


def error_metrics(
    length_m: float, name: str = "tip_error", label: str = "tip error"
) -> list[Metric]:
    """Return metrics of a distance, in metres and as a share of the length.

    Parameters
    ----------
    length_m : float
        The robot's length [m]: no tip can be further from a goal than twice that.
    name, label : str

    Returns
    -------
    list of Metric

    Examples
    --------
    >>> [metric.name for metric in error_metrics(0.2)]
    ['tip_error_m', 'tip_error_percent']
    """
    return [
        Metric(f"{name}_m", label, "m", 2.0 * length_m),
        Metric(f"{name}_percent", label, "% of length", 200.0),
    ]


class _Bounds(NamedTuple):
    """What an error is held against."""

    scale: FloatArray
    weight: FloatArray
    tolerance: FloatArray
    decay: FloatArray


class ShapedTask(GoalTask):
    r"""Errors that are to become small.

    With errors e the dense reward is the mean of two terms in [0, 1]: closeness
    :math:`1/(1 + e/s)`, the mean over the errors, which has a slope everywhere, and precision
    :math:`\exp(-\sum(e/\epsilon)^2)`, which asks for the last bit. The sparse reward is 0 on
    success and -1 otherwise. Success means that every e is at most its tolerance.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon of a distance, as a fraction of the robot's length; None for the
        difficulty's: 0.04, 0.02 and 0.01 at 0, 0.5 and 1.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard".
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.

    Raises
    ------
    ValueError, TypeError
        If `reward` is unknown, `success_tolerance` is not positive and finite, `difficulty` is
        outside [0, 1], or `random_start` is neither true nor false.
    """

    easiest_tolerance = EASIEST_TOLERANCE
    hardest_share = HARDEST_SHARE

    def __init__(
        self,
        robot: Robot,
        reward: str,
        success_tolerance: float | None,
        difficulty: float | str,
        random_start: bool,
    ) -> None:
        check_choice("reward", reward, REWARDS)
        if success_tolerance is not None:
            check_positive("success_tolerance", success_tolerance)
            if success_tolerance > MOST_TOLERANCE:
                raise ValueError(
                    f"success_tolerance is a fraction of the length of at most {MOST_TOLERANCE}, "
                    f"got {success_tolerance!r}: every tip would be a success"
                )
        if not isinstance(random_start, bool):
            raise TypeError(f"random_start must be true or false, got {random_start!r}")
        self._given_tolerance = success_tolerance
        self._sparse, self._random_start = reward == "sparse", random_start
        self._percent = constant(100.0 / robot.length_m)
        super().__init__(robot, difficulty)

    def settle(self) -> None:
        """Derive tolerances and scales from the difficulty."""
        given = self._given_tolerance
        if given is None:
            given = self.easiest_tolerance * self.hardest_share**self.difficulty
        self.success_tolerance = float(given)
        bounds = self.tolerances()
        share = 0.5 / len(bounds)
        self._bounds = [
            _Bounds(*map(constant, (scale, share * scale, epsilon, -1.0 / epsilon**2)))
            for scale, epsilon in bounds
        ]

    def tolerances(self) -> list[tuple[float, float]]:
        """Return scale s and tolerance epsilon of each error, in SI units; one distance here."""
        length = self.robot.length_m
        return [(CLOSENESS_SCALE * length, self.success_tolerance * length)]

    def predicted(self, bending: FloatArray) -> FloatArray:
        """Return the tip positions [m] of shapes (..., S, 2) [rad]."""
        position: FloatArray = kinematics.forward(bending, self.robot.lengths)[0]
        return position

    def achieved(self, state: RobotState) -> FloatArray:
        """Return what is compared with the goal (B, size); the tip position [m] here."""
        return state.tip_position

    def squares(self, achieved: FloatArray, desired: FloatArray) -> list[FloatArray]:
        """Return the square of each error (B,) of what is achieved and desired, both (B, size).

        The first three numbers are positions here, whose distance is the only error.
        """
        gap = achieved[:, :3] - desired[:, :3]
        return [np.vecdot(gap, gap)]

    def ways(
        self, achieved: FloatArray, desired: FloatArray, errors: list[FloatArray]
    ) -> list[FloatArray]:
        """Return how far it is to go, (B,) each: what closeness is told by; the errors here."""
        del achieved, desired
        return errors

    def told(self, errors: list[FloatArray]) -> Mapping[str, FloatArray]:
        """Return the metrics of the errors (B,); those of one distance of the tip here."""
        return {"tip_error_m": errors[0], "tip_error_percent": errors[0] * self._percent}

    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of what is achieved and desired, both (B, size) in SI units."""
        squares = self.squares(achieved, desired)
        errors = [np.sqrt(square) for square in squares]
        ways = self.ways(achieved, desired, errors)
        closeness = reduce(
            add, [b.weight / (b.scale + w) for b, w in zip(self._bounds, ways, strict=True)]
        )
        exponent = reduce(
            add, [square * b.decay for b, square in zip(self._bounds, squares, strict=True)]
        )
        success = reduce(
            and_, [e <= b.tolerance for b, e in zip(self._bounds, errors, strict=True)]
        )
        precision = 0.5 * np.exp(np.maximum(exponent, -700.0))  # underflow is slow
        return Outcome(
            reward=success.astype(np.float64) - 1.0 if self._sparse else closeness + precision,
            success=success,
            metrics=self.told(errors),
            terms={"closeness": closeness, "precision": precision},
        )

    def shapes(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start and goal shapes [rad], both (R, S, 2), of 4 S uniform numbers (R, 4 S).

        Every segment's tip is uniform over its dome.
        """
        pairs = numbers.reshape(len(numbers), 2, self.robot.n_segments, 2)
        bending = kinematics.sample_dome(pairs, self.robot.max_bending)
        start = bending[:, 0]
        return start if self._random_start else np.zeros_like(start), bending[:, 1]


class CostedTask(ShapedTask):
    """A goal position that stands, and beside it a cost that is to be zero.

    Parameters of episodes begin with the four numbers of the goal.
    """

    moves = False

    def advance(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the goals (B, 4): positions [m], and no cost."""
        del time_s
        return parameters[:, :4]

    def aimed(self, parameters: FloatArray, goal: FloatArray) -> FloatArray:
        """Return parameters with goal positions (R, 3) [m] that somebody asks for."""
        return np.hstack([goal, parameters[:, 3:]])
