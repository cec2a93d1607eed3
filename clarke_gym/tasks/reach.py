"""Reach: bring the tip to a goal position."""

from __future__ import annotations

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Goal, register_task
from clarke_gym.tasks.shaped import ShapedTask, error_metrics


@register_task("reach")
class Reach(ShapedTask):
    r"""Reach a goal position with the tip.

    The error is the distance e between tip and goal; its scale s is a tenth of the length. The
    dense reward is :math:`\frac12/(1 + e/s) + \frac12\exp(-(e/\epsilon)^2)`.

    Goals of one segment are uniform over the dome of its tip positions. With several segments each
    segment's bend is drawn that way and the goal is the tip of that shape, so it is reachable.

    Parameters
    ----------
    robot : Robot
    reward : {"dense", "sparse"}
        In [0, 1], or 0 on success and -1 otherwise.
    success_tolerance : float or None
        Tolerance epsilon, as a fraction of the robot's length; None for the difficulty's: 0.04,
        0.02 and 0.01 at difficulty 0, 0.5 and 1.
    difficulty : float or str
        In [0, 1], or "easy", "medium", "hard".
    random_start : bool
        Start from a random shape drawn like the goals; straight otherwise.
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
        super().__init__(robot, reward, success_tolerance, difficulty, random_start)
        self.numbers = 4 * robot.n_segments
        self.goal = Goal(("x", "y", "z"), "m", robot.length_m)
        self.metrics = tuple(error_metrics(robot.length_m))

    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2) and goal positions [m] (R, 3)."""
        start, shape = self.shapes(numbers)
        return start, self.predicted(shape)
