"""Hold: keep the tip at its goal under an unknown payload and pushes."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.noise import directions, uniforms
from clarke_gym.physics.base import RobotState
from clarke_gym.robots import Robot
from clarke_gym.robots.stiffness import bending_stiffness
from clarke_gym.tasks.base import Goal, Metric, Outcome, register_task
from clarke_gym.tasks.shaped import CostedTask, error_metrics

LIGHTEST, HEAVIEST = 0.2, 1.2
"""Largest static load over E I / l^2, at difficulty 0 and 1: 0.05 and 0.3 N for the default robot,
which 0.5 N bend by a sixth of its length."""

PUSH_SHARE = 1.0
"""Largest push over the largest static load."""

PUSH_S, EVERY_S = 0.2, 1.0
"""How long a push lasts, and how often one comes."""

EFFORT_SHARE = 0.2
"""Share of the reward that full co-contraction costs."""


@register_task("hold")
class Hold(CostedTask):
    r"""Keep the tip where it is while something pulls at it.

    A static load of unknown size and direction acts on the tip, and every second a push of 0.2 s
    in another direction. Both are at most 0.2 to 1.2 times :math:`EI/l^2`, 0.05 to 0.3 N for the
    default robot: what its backbone can answer.

    The goal is the tip of the unloaded start shape. With the distance e between tip and goal and
    the effort h, the mean tension above pretension over twice the pretension, at most 1, the dense
    reward is :math:`(1-0.2h)\left(\frac12/(1+e/s)+\frac12\exp(-(e/\epsilon)^2)\right)`. A step is
    a success where e is within the tolerance; an episode's score is the share of such steps.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float
        Tolerance epsilon, as a fraction of the robot's length.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard": heavy loads are hard.
    """

    sensors: ClassVar[tuple[str, ...]] = (
        "command",
        "displacement",
        "velocity",
        "tension",
        "tip_position",
        "tip_velocity",
    )
    needs: ClassVar[tuple[str, ...]] = ("load", "tension")
    max_episode_steps = 100

    def __init__(
        self,
        robot: Robot,
        *,
        reward: str = "dense",
        success_tolerance: float = 0.02,
        difficulty: float | str = 0.5,
    ) -> None:
        super().__init__(robot, reward, success_tolerance, difficulty, random_start=True)
        self.numbers = 4 * robot.n_segments + 4
        self.goal = Goal(("x", "y", "z", "effort"), "m, 1", (robot.length_m,) * 3 + (1.0,), costs=1)
        self.metrics = (
            Metric("held", "time held", "", 0.0, over="mean"),
            Metric("tip_error_rms_m", "tip error, RMS", "m", 2.0 * robot.length_m, over="rms"),
            *error_metrics(robot.length_m),
            Metric("effort", "effort", "", 1.0, over="mean"),
        )
        full = [2.0 * s.pretension_n or 20.0 for s in robot.segments]
        self._full_n = np.repeat(full, robot.n_tendons)
        self._rest_n = np.repeat([s.pretension_n for s in robot.segments], robot.n_tendons)

    def settle(self) -> None:
        """Derive the loads from the difficulty."""
        super().settle()
        softest = min(bending_stiffness(segment) for segment in self.robot.segments)
        share = LIGHTEST + (HEAVIEST - LIGHTEST) * self.difficulty
        self.most_n = share * softest / self.robot.length_m**2

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return starts [rad] (R, S, 2), and goals, loads and keys of pushes (R, 8)."""
        start, _ = self.shapes(numbers[:, : 4 * self.robot.n_segments])
        position = self.predicted(start)
        rest = numbers[:, 4 * self.robot.n_segments :]
        load = self.most_n * rest[:, :1] * directions(rest[:, 1:3])
        return start, np.hstack([position, np.zeros((len(start), 1)), load, rest[:, 3:]])

    def force(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return loads and pushes [N]."""
        turn = np.floor(time_s / EVERY_S + 1e-9).astype(np.int64)
        u = uniforms(parameters[:, 7], turn, 3)
        since = time_s - turn * EVERY_S - 0.5 * (EVERY_S - PUSH_S)  # the middle of a second
        pushing = (since > -1e-9) & (since < PUSH_S - 1e-9)
        size = PUSH_SHARE * self.most_n * u[:, 0] * pushing
        return parameters[:, 4:7] + size[:, None] * directions(u[:, 1:])

    def achieved(self, state: RobotState) -> FloatArray:
        """Return the tip position [m] and the effort."""
        above = np.maximum(state.tension - self._rest_n, 0.0) / self._full_n
        return np.hstack([state.tip_position, np.minimum(above.mean(1, keepdims=True), 1.0)])

    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of positions [m] and efforts, both (B, 4)."""
        outcome, effort = super().score(achieved, desired), achieved[:, 3]
        left = 1.0 - EFFORT_SHARE * effort
        outcome.terms = {name: left * term for name, term in outcome.terms.items()}
        if not self._sparse:
            outcome.reward = outcome.terms["closeness"] + outcome.terms["precision"]
        outcome.metrics = {
            "held": outcome.success.astype(np.float64),
            "tip_error_rms_m": outcome.metrics["tip_error_m"],
            **outcome.metrics,
            "effort": effort,
        }
        return outcome
