"""The clock of every environment: steps, goals, seeds, and the time limit."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from clarke_gym.numerics.ahead import Ahead
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.tasks import Task

_ALL = slice(None)

_DISTURBED = 1
"""Word that the seeds of disturbances have beside those of tasks."""


class Episode:
    """Where the environments are in their episodes, and what the next ones begin with.

    Each environment has a generator of its own seed, and draws the numbers of its episodes from it
    one episode after the other, so its episodes depend on its own seed alone.

    Parameters
    ----------
    task : Task
    num_envs : int
    control_dt : float
        [s].
    limit : int
        Steps after which an episode is truncated.
    prepare : callable
        Turns start bending vectors (R, S, 2) into what R robots are put at: two arrays with R rows.
    disturbed : int
        Uniform numbers that disturbances draw for each episode.
    """

    def __init__(
        self,
        task: Task,
        num_envs: int,
        control_dt: float,
        limit: int,
        prepare: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
        disturbed: int = 0,
    ) -> None:
        self._task, self._prepare, self._control_dt = task, prepare, control_dt
        self.limit, self._block = limit, task.prepared
        self.generators: list[np.random.Generator | None] = [None] * num_envs
        self.seeds = [0] * num_envs
        self._disturbing: list[np.random.Generator | None] = [None] * num_envs
        self.disturbed = np.zeros((num_envs, disturbed))
        probe = np.asarray(task.draw(np.random.default_rng(0)), np.float64)
        self._numbers = np.zeros((num_envs, self._block, probe.size))
        self._used = np.full(num_envs, self._block)
        parts = self._begin(probe[None])
        self._prepared = [np.zeros((num_envs, self._block, *part.shape[1:])) for part in parts]
        self._parameters = np.zeros((num_envs, parts[2].shape[1]))
        self._told_by = type(task).advance is not Task.advance
        self._moves = task.goal_moves
        self._plain = type(task).draw is Task.draw
        self.steps = np.zeros(num_envs, dtype=np.int64)
        self.begun = False
        size = self._parameters.shape[1] if task.goal is None else task.goal.size
        self.goal = np.zeros((num_envs, size))
        self._ahead = Ahead(task.previews)
        self._all = np.arange(num_envs)

    def _begin(self, numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where robots are put (two arrays), and what goals are made of."""
        bending, parameters = (np.asarray(part, np.float64) for part in self._task.begin(numbers))
        return *self._prepare(bending), parameters

    def _follow(self, rows: NDArray[np.intp] | slice) -> None:
        """Bring some goals up to date."""
        if self._moves:
            self.goal[rows] = self._ahead.at(self.steps, self._tell)[rows]
            return
        goal = self._parameters[rows]
        if self._told_by:
            goal = self._task.advance(goal, self.time_s[rows])
        self.goal[rows] = self._rounded(goal)

    def _rounded(self, goal: FloatArray) -> FloatArray:
        """Return goals that are what policies see of them, to single precision."""
        shown = self._task.goal
        return goal if shown is None else shown.meant(shown.observed(goal))

    @property
    def observed_goal(self) -> NDArray[np.float32]:
        """The goals as policies see them, shape (B, size)."""
        assert self._task.goal is not None
        return self._task.goal.observed(self.goal)

    @property
    def parameters(self) -> FloatArray:
        """What `Task.begin` told of the episodes of now, shape (B, p), to read."""
        return self._parameters

    @property
    def time_s(self) -> FloatArray:
        """Time since the episodes' beginnings [s], shape (B,)."""
        return self.steps * np.float64(self._control_dt)

    def goal_after(self, steps: int) -> FloatArray:
        """Return the goals that there will be in some control periods, (B, size) in SI units."""
        if not self._moves:
            return self.goal
        if steps > self._task.previews:
            return self._tell(self._all, self.steps + steps)
        return self._ahead.later(steps)

    def _tell(self, rows: NDArray[np.intp], steps: NDArray[np.int64]) -> FloatArray:
        """Return the goals of some environments at some steps."""
        time_s = steps * np.float64(self._control_dt)
        return self._rounded(self._task.advance(self._parameters[rows], time_s))

    def prepare_again(self) -> None:
        """Prepare the episodes to come anew, from the numbers that were drawn for them."""
        rows = np.flatnonzero(self._used < self._block)
        if rows.size:
            self._prepare_rows(rows)

    @property
    def truncated(self) -> NDArray[np.bool_]:
        """Which environments have come to the time limit, shape (B,)."""
        return self.steps >= self.limit

    def seed(self, index: int, seed: int | None) -> None:
        """Give environment `index` a new generator; None takes entropy from the system."""
        generator, actual = seeding.np_random(seed)
        self.generators[index] = generator
        self.seeds[index] = int(actual)
        if self.disturbed.shape[1]:  # to make a generator takes as long as to draw an episode
            self._disturbing[index] = np.random.default_rng([int(actual), _DISTURBED])
        self._used[index] = self._block

    def advance(self) -> None:
        """Count a step of all environments."""
        self.steps += 1
        if self._moves:
            self._follow(_ALL)

    def start(
        self, rows: NDArray[np.intp], goal: FloatArray | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Begin new episodes in the environments `rows`, and return where their robots are put."""
        first, second, parameters = self._draw(rows)
        self._parameters[rows] = parameters if goal is None else self._task.aimed(parameters, goal)
        self.steps[rows] = 0
        self._ahead.forget(rows)
        self.begun = True
        if self.disturbed.shape[1]:
            for index in rows.tolist():
                generator = self._disturbing[index]
                assert generator is not None
                self.disturbed[index] = generator.random(self.disturbed.shape[1])
        self._follow(rows)
        return first, second

    def begin_at(self, parameters: FloatArray, steps: int) -> None:
        """Put all environments into one episode that parameters (p,) tell."""
        self._parameters[:], self.steps[:], self.begun = parameters, steps, True
        self._ahead.forget()
        self._follow(_ALL)

    def _draw(self, rows: NDArray[np.intp]) -> list[FloatArray]:
        used = self._used[rows]
        empty = used == self._block
        if np.count_nonzero(empty):
            self._refill(rows[empty])
            used[empty] = 0
        self._used[rows] = used + 1
        return [part[rows, used] for part in self._prepared]

    def _refill(self, rows: NDArray[np.intp]) -> None:
        for index in rows.tolist():
            if self.generators[index] is None:
                self.seed(index, None)
            generator = self.generators[index]
            assert generator is not None
            if self._plain:  # the same numbers in one call
                generator.random(out=self._numbers[index])
                continue
            for k in range(self._block):
                self._numbers[index, k] = self._task.draw(generator)
        self._prepare_rows(rows)

    def _prepare_rows(self, rows: NDArray[np.intp]) -> None:
        numbers = self._numbers[rows]
        parts = self._begin(numbers.reshape(len(rows) * self._block, numbers.shape[-1]))
        for kept, part in zip(self._prepared, parts, strict=True):
            kept[rows] = part.reshape(len(rows), self._block, *part.shape[1:])

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return {
            "generators": copy.deepcopy(self.generators),
            "disturbing": copy.deepcopy(self._disturbing),
            "disturbed": self.disturbed.copy(),
            "seeds": list(self.seeds),
            "numbers": self._numbers.copy(),
            "used": self._used.copy(),
            "parameters": self._parameters.copy(),
            "steps": self.steps.copy(),
            "begun": self.begun,
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`."""
        self.generators = copy.deepcopy(state["generators"])
        self._disturbing = copy.deepcopy(state["disturbing"])
        self.disturbed = state["disturbed"].copy()
        self.seeds = list(state["seeds"])
        self._numbers, self._used = state["numbers"].copy(), state["used"].copy()
        self._parameters = state["parameters"].copy()
        self.steps[:] = state["steps"]  # disturbances look at this very array
        self.begun = state["begun"]
        self._ahead.forget()
        self._prepare_rows(np.arange(len(self._numbers)))
        self._follow(_ALL)
