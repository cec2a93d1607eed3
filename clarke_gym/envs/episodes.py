"""One random generator per environment, drawn in blocks so that resets stay vectorised."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray

BLOCK = 16

Parts: TypeAlias = tuple[NDArray[Any], ...]
"""What episodes begin with, arrays with a row for each."""


class EpisodeStreams:
    """Random beginnings of episodes, one stream per environment.

    A generator is asked for the uniform numbers of `BLOCK` episodes at once; they are the numbers
    that it would have given episode by episode, so an environment's episodes depend on its own seed
    alone.

    Parameters
    ----------
    num_envs : int
    width : int
        Uniform numbers per episode.
    prepare : callable
        Turns numbers of shape (R, width) into what R episodes begin with, row by row: some arrays
        with R rows.
    """

    def __init__(self, num_envs: int, width: int, prepare: Callable[[FloatArray], Parts]) -> None:
        self.generators: list[np.random.Generator | None] = [None] * num_envs
        self.seeds = [0] * num_envs
        self._prepare = prepare
        self._rows = np.zeros((num_envs, BLOCK, width))
        self._used = np.full(num_envs, BLOCK)
        like = prepare(self._rows[:1, 0])
        self._prepared = [np.zeros((num_envs, BLOCK, *part.shape[1:]), part.dtype) for part in like]

    def seed(self, index: int, seed: int | None) -> None:
        """Give environment `index` a new generator; None takes entropy from the system."""
        generator, actual = seeding.np_random(seed)
        self.generators[index] = generator
        self.seeds[index] = int(actual)
        self._used[index] = BLOCK

    def draw(self, rows: NDArray[np.intp]) -> Parts:
        """Return what the next episode of each stream in `rows` begins with, to read at once."""
        if len(self.generators) == 1 and len(rows):  # slices cost a tenth of lookups
            next_one = self._used.item()
            if next_one == BLOCK:
                self._refill(rows)
                next_one = 0
            self._used[0] = next_one + 1
            return tuple([part[:, next_one] for part in self._prepared])
        used = self._used[rows]
        empty = used == BLOCK
        if np.count_nonzero(empty):
            self._refill(rows[empty])
            used[empty] = 0
        self._used[rows] = used + 1
        return tuple(part[rows, used] for part in self._prepared)

    def _refill(self, rows: NDArray[np.intp]) -> None:
        for index in rows.tolist():
            generator = self.generators[index]
            if generator is None:
                self.seed(index, None)
                generator = self.generators[index]
                assert generator is not None
            generator.random(out=self._rows[index])
        self._prepare_rows(rows)

    def _prepare_rows(self, rows: NDArray[np.intp]) -> None:
        numbers = self._rows[rows]
        prepared = self._prepare(numbers.reshape(-1, numbers.shape[-1]))
        for kept, part in zip(self._prepared, prepared, strict=True):
            kept[rows] = part.reshape(len(rows), BLOCK, *part.shape[1:])

    def get_state(self) -> dict[str, Any]:
        """Return a copy of all generators and unused numbers."""
        return {
            "generators": copy.deepcopy(self.generators),
            "seeds": list(self.seeds),
            "rows": self._rows.copy(),
            "used": self._used.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`."""
        self.generators = copy.deepcopy(state["generators"])
        self.seeds = list(state["seeds"])
        self._rows = state["rows"].copy()
        self._used = state["used"].copy()
        self._prepare_rows(np.arange(len(self._rows)))
