"""One random generator per environment, drawn in blocks so that resets stay vectorised."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray

BLOCK = 16


class UniformStreams:
    """Rows of uniform numbers, one stream per environment.

    A generator is asked for `BLOCK` rows at once; they are the numbers that it would have given
    row by row, so an environment's episodes depend on its own seed alone.

    Parameters
    ----------
    num_envs : int
    width : int
        Numbers per row.
    """

    def __init__(self, num_envs: int, width: int) -> None:
        self.generators: list[np.random.Generator | None] = [None] * num_envs
        self.seeds = [0] * num_envs
        self._rows = np.zeros((num_envs, BLOCK, width))
        self._used = np.full(num_envs, BLOCK)

    def seed(self, index: int, seed: int | None) -> None:
        """Give environment `index` a new generator; None takes entropy from the system."""
        generator, actual = seeding.np_random(seed)
        self.generators[index] = generator
        self.seeds[index] = int(actual)
        self._used[index] = BLOCK

    def draw(self, rows: NDArray[np.intp]) -> FloatArray:
        """Return the next row of each stream in `rows`, shape (len(rows), width)."""
        for index in rows[self._used[rows] == BLOCK]:
            generator = self.generators[index]
            if generator is None:
                self.seed(int(index), None)
                generator = self.generators[index]
                assert generator is not None
            generator.random(out=self._rows[index])
            self._used[index] = 0
        result = self._rows[rows, self._used[rows]]
        self._used[rows] += 1
        return result

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
