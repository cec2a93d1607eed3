"""What a task is: it begins episodes, and evaluates what robots do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, constant
from clarke_gym.numerics.checks import check_choice
from clarke_gym.numerics.registry import Registry
from clarke_gym.physics.base import RobotState
from clarke_gym.robots.robot import Robot
from clarke_gym.robots.scene import EMPTY, Scene

OVER = ("now", "mean", "rms", "least", "most", "fall")
"""What a metric can tell of an episode."""

RUNGS = {"easy": 0.0, "medium": 0.5, "hard": 1.0}
"""Names for difficulties."""

BoolArray = NDArray[np.bool_]
Float32Array = NDArray[np.float32]


@dataclass(frozen=True)
class Metric:
    """A number that tells how well an episode went, by the name it has wherever it appears.

    Parameters
    ----------
    name : str
        Its key in `info`, in evaluations and in tables, e.g. "tip_error_m".
    label : str
        What people read, e.g. "tip error".
    unit : str
        Of the number, e.g. "m", "%", or "" for none.
    worst : float
        What an episode that failed counts as.
    over : {"now", "mean", "rms", "least", "most", "fall"}
        Whether `info` holds the number of the step, or what it was over the episode so far: its
        mean, its root mean square, its smallest or its largest value, or how far it is below that.
    """

    name: str
    label: str
    unit: str
    worst: float
    over: str = "now"

    def __post_init__(self) -> None:
        check_choice("over", self.over, OVER)


@dataclass(frozen=True)
class Goal:
    """The numbers that say what is to be reached.

    Parameters
    ----------
    labels : tuple of str
        A name for each number.
    unit : str
        Of all of them, or of groups, e.g. "m, 1".
    scale : float or tuple of float
        What they are divided by where policies see them: all, or each.
    bound : float
        Largest magnitude of a number that policies see.
    costs : int
        How many of the last numbers are to become zero, whatever the episode (depth in a body,
        effort): a part of achieved and desired goals that sensors leave out.

    Examples
    --------
    >>> goal = Goal(("x", "y", "z"), "m", scale=0.2)
    >>> goal.observed(np.array([[0.1, 0.0, 0.1]]))
    array([[0.5, 0. , 0.5]], dtype=float32)
    """

    labels: tuple[str, ...]
    unit: str
    scale: float | tuple[float, ...]
    bound: float = 1.0
    costs: int = 0

    @cached_property
    def shown(self) -> slice:
        """The numbers that sensors see: all but the costs."""
        return slice(0, self.size - self.costs)

    @cached_property
    def size(self) -> int:
        """How many numbers."""
        return len(self.labels)

    @cached_property
    def divisor(self) -> FloatArray:
        """The scale in double precision, shape () or (size,)."""
        return constant(self.scale)

    @cached_property
    def positions(self) -> NDArray[np.intp]:
        """Where positions stand among the numbers that sensors see, the tip's last, (P, 3)."""
        firsts = [label[:1] for label in self.labels[self.shown]]
        found = [k for k in range(len(firsts) - 2) if firsts[k : k + 3] == ["x", "y", "z"]]
        return np.array([[k, k + 1, k + 2] for k in found], np.intp).reshape(-1, 3)

    @property
    def observed_scale(self) -> FloatArray:
        """The divisor of the numbers that sensors see: one, or one each."""
        return self.divisor if self.divisor.ndim == 0 else self.divisor[self.shown]

    @property
    def is_position(self) -> bool:
        """Whether a controller that steers the tip to a point can reach it."""
        return self.labels[self.shown] == ("x", "y", "z")

    def observed(self, goal: FloatArray) -> Float32Array:
        """Return goals in SI units (B, size) as policies see them."""
        return (goal / self.divisor).astype(np.float32)

    def meant(self, observed: Float32Array) -> FloatArray:
        """Return what observed goals say, in SI units."""
        return observed.astype(np.float64) * self.divisor


@dataclass(slots=True)
class Outcome:
    """What a task says of B robots.

    Parameters
    ----------
    reward : ndarray, shape (B,)
    success : ndarray of bool, shape (B,)
    metrics : mapping of str to ndarray, shape (B,)
        The numbers that `Task.metrics` declares.
    terms : mapping of str to ndarray, shape (B,)
        What the reward is the sum of, for `info`.
    failure : ndarray of bool, shape (B,), optional
        Where an episode ends because it cannot go on.
    """

    reward: FloatArray
    success: BoolArray
    metrics: Mapping[str, FloatArray] = field(default_factory=dict)
    terms: Mapping[str, FloatArray] = field(default_factory=dict)
    failure: BoolArray | None = None


class Task(ABC):
    """What is asked of a batch of robots.

    A task sees plain arrays with a row for each robot, in SI units; it knows neither the physics
    nor the representation. The keyword-only arguments of its constructor are keyword arguments of
    its environments.

    Parameters
    ----------
    robot : Robot

    Notes
    -----
    An episode is drawn as a row of numbers (`draw`, as the task likes: rejection, curricula), which
    `begin` turns into a start and what `advance` makes goals of. A row depends on its environment's
    generator alone, so environment i of a batch equals the scalar one of its seed.
    """

    name: ClassVar[str] = ""
    """What `register_task` calls it."""
    sensors: ClassVar[tuple[str, ...]] = ("command", "displacement", "tip_position")
    """Names of what policies see by default, without the goal."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Nouns of `RobotState` that not every physics has, e.g. "contact_force"."""
    max_episode_steps: ClassVar[int] = 50
    moves: ClassVar[bool] = True
    """Whether goals that `advance` tells change during an episode."""
    prepared: ClassVar[int] = 16
    """Episodes that an environment draws at once, so that they are prepared in one go."""
    previews: ClassVar[int] = 0
    """Control periods that the sensor "preview" sees a moving goal ahead."""

    numbers: int = 0
    """Uniform random numbers that an episode is drawn from."""
    goal: Goal | None = None
    scene: Scene = EMPTY
    metrics: tuple[Metric, ...] = ()
    """What tells how well an episode went; the first one leads in reports."""

    def __init__(self, robot: Robot, difficulty: float | str = 0.5) -> None:
        self.robot = robot
        self.set_difficulty(difficulty)

    def set_difficulty(self, difficulty: float | str) -> None:
        """Make the episodes that begin from now on easier or harder.

        What `begin` told of an episode stays its own; what `settle` derives changes at once.

        Parameters
        ----------
        difficulty : float or str
            In [0, 1], or a name of `RUNGS`.

        Raises
        ------
        ValueError, TypeError
            If it is neither, or `settle` refuses it: then the one before stays.
        """
        value = RUNGS.get(difficulty) if isinstance(difficulty, str) else difficulty
        if isinstance(value, bool) or not isinstance(value, int | float | None):
            raise TypeError(f"difficulty must be a number or a name, got {difficulty!r}")
        if value is None or not 0.0 <= value <= 1.0:
            raise ValueError(
                f"difficulty must be from 0 to 1 or one of {list(RUNGS)}, got {difficulty!r}"
            )
        before = getattr(self, "difficulty", None)
        self.difficulty = float(value)
        try:
            self.settle()
        except (ValueError, TypeError):
            if before is not None:
                self.difficulty = before
                self.settle()
            raise

    def settle(self) -> None:  # noqa: B027 (most tasks have nothing to derive)
        """Derive what depends on the difficulty."""

    @property
    def goal_moves(self) -> bool:
        """Whether the goal changes during an episode."""
        return self.moves and type(self).advance is not Task.advance

    def draw(self, rng: np.random.Generator) -> FloatArray:
        """Return the numbers of one episode, shape (k,)."""
        return rng.random(self.numbers)

    @abstractmethod
    def begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return start bending vectors [rad] (R, S, 2), and what goals are made of (R, p)."""

    def advance(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return the goals (B, size) at the times (B,) since the episodes' beginnings."""
        del time_s
        return parameters

    def aimed(self, parameters: FloatArray, goal: FloatArray) -> FloatArray:
        """Return the parameters (R, p) of episodes with goals that somebody asks for (R, k)."""
        if type(self).advance is not Task.advance:
            raise ValueError(f"options['goal']: goals of {type(self).__name__} move by themselves")
        del parameters
        return goal

    def places(self, parameters: FloatArray) -> FloatArray:
        """Return where the bodies of a placed scene are: ends and radius [m], (R, K, 7)."""
        raise NotImplementedError(f"{type(self).__name__} has a placed scene, but no places")

    def force(self, parameters: FloatArray, time_s: FloatArray) -> FloatArray:
        """Return forces on the tips in the base frame [N], (B, 3), held for a control period."""
        del time_s
        return np.zeros((len(parameters), 3))

    @abstractmethod
    def evaluate(self, state: RobotState, goal: FloatArray) -> Outcome:
        """Return reward, success, failure and metrics; `goal` is in SI units (B, size)."""


class GoalTask(Task):
    """A task whose reward compares what is achieved with a goal, and with nothing else.

    Both are rounded as policies see them, so that rewards asked of observed goals, for hindsight
    replay, are the very same.
    """

    goal: Goal

    def predicted(self, bending: FloatArray) -> FloatArray:
        """Return what the shapes (..., S, 2) [rad] of constant curvature achieve, (..., k).

        In SI units, without costs. Goals are drawn with it and controllers plan with it.
        """
        raise NotImplementedError(f"{type(self).__name__} cannot tell what shapes achieve")

    @abstractmethod
    def achieved(self, state: RobotState) -> FloatArray:
        """Return what is compared with the goal, in SI units (B, size)."""

    @abstractmethod
    def score(self, achieved: FloatArray, desired: FloatArray) -> Outcome:
        """Return the outcome of achieved and desired goals in SI units, both (B, size)."""

    def seen(self, state: RobotState) -> tuple[Float32Array, FloatArray]:
        """Return what is achieved as policies see it, and what that says in SI units."""
        seen: tuple[Float32Array, FloatArray] = state.once("achieved", self._seen)
        return seen

    def _seen(self, state: RobotState) -> tuple[Float32Array, FloatArray]:
        observed = self.goal.observed(self.achieved(state))
        return observed, self.goal.meant(observed)

    def evaluate(self, state: RobotState, goal: FloatArray) -> Outcome:
        """Return the outcome of what is achieved."""
        return self.score(self.seen(state)[1], goal)


TASKS: Registry[Any] = Registry("task")
"""Tasks by name."""


def register_task(name: str) -> Callable[[Any], Any]:
    """Return a decorator that makes a task available as ``task=name``.

    Parameters
    ----------
    name : str
        A word of letters, digits and "_".

    Returns
    -------
    callable

    Raises
    ------
    ValueError, TypeError
        If the name is taken, or what is decorated is no `Task`.

    Examples
    --------
    >>> @register_task("stay_doctest")
    ... class Stay(Task):
    ...     def begin(self, numbers):
    ...         return np.zeros((len(numbers), self.robot.n_segments, 2)), numbers
    ...     def evaluate(self, state, goal):
    ...         still = np.linalg.norm(state.tip_position[:, :2], axis=1)
    ...         return Outcome(-still, still < 0.01)
    """
    return TASKS.decorator(name, Task)
