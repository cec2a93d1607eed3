"""Numbers of every step, computed for many steps at once: NumPy calls on few numbers are slow."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray

Tell: TypeAlias = Callable[[NDArray[np.intp], NDArray[np.int64]], FloatArray]
"""Rows (R,) and steps, both of R numbers -> what there is then, (R, k)."""

STEPS = 32
"""Steps that are told at once."""


class Ahead:
    """What follows from a row and its step alone, kept for the next steps of each row.

    Parameters
    ----------
    previews : int
        Steps beyond now that `later` is asked for.

    Examples
    --------
    >>> kept, square = Ahead(), lambda rows, steps: steps[:, None] ** 2.0
    >>> kept.at(np.array([3, 0]), square).T, kept.at(np.array([4, 1]), square).T
    (array([[9., 0.]]), array([[16.,  1.]]))
    """

    def __init__(self, previews: int = 0) -> None:
        self._count = STEPS + previews
        self._told: FloatArray | None = None

    def forget(self, rows: NDArray[np.intp] | None = None) -> None:
        """Tell some rows anew, or all: what their numbers follow from has changed."""
        if rows is None:
            self._told = None
        elif self._told is not None:
            self._from[rows] = -STEPS

    def at(self, steps: NDArray[np.int64], tell: Tell) -> FloatArray:
        """Return the numbers (B, k) of all rows at their steps.

        What is not known is asked of `tell`, whose rows come several times.
        """
        if self._told is None:
            self._first = self._count * np.arange(len(steps))
            self._from = np.full(len(steps), -STEPS, dtype=np.int64)
        place = steps - self._from
        known = place.view(np.uint64) < STEPS  # as unsigned, what is before is far behind
        if np.count_nonzero(known) < len(known):
            late = np.flatnonzero(~known)
            self._from[late], place[late] = steps[late], 0
            then = steps[late, None] + np.arange(self._count)
            told = tell(np.repeat(late, self._count), then.reshape(-1))
            if self._told is None:
                self._told = np.array(told, order="C")  # ours to write to
            else:
                windows = self._told.reshape(len(steps), self._count, -1)
                windows[late] = told.reshape(len(late), self._count, -1)
        self._now = self._first + place
        return self.later(0)

    def later(self, ahead: int) -> FloatArray:
        """Return the numbers some steps after those of the last `at`."""
        assert self._told is not None
        return self._told.take(self._now + ahead, axis=0)
