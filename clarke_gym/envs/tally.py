"""What metrics were over the episodes so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.tasks import Metric


class Tally:
    """Keeps means, root mean squares and extremes of metrics that are of the whole episode.

    Parameters
    ----------
    metrics : sequence of Metric
        Those of a task.
    num_envs : int

    Examples
    --------
    >>> tally = Tally([Metric("hit", "hits", "", 0.0, over="mean")], 1)
    >>> for step, hit in enumerate([1.0, 0.0, 1.0, 1.0]):
    ...     told = tally.over({"hit": np.array([hit])}, np.array([step]))
    >>> told["hit"]  # the state that an episode begins with does not count
    array([0.66666667])
    """

    def __init__(self, metrics: Sequence[Metric], num_envs: int) -> None:
        self._over = {metric.name: metric.over for metric in metrics if metric.over != "now"}
        self._kept = {name: np.zeros(num_envs) for name in self._over}
        self._at = np.full(num_envs, -1, dtype=np.int64)

    def over(
        self, now: Mapping[str, FloatArray], steps: NDArray[np.int64]
    ) -> dict[str, FloatArray]:
        """Return the metrics of the episodes so far.

        Parameters
        ----------
        now : mapping of str to ndarray, shape (B,)
            What they are in this step.
        steps : ndarray of int, shape (B,)
            Steps since the episodes began. A step that was counted is not counted again.

        Returns
        -------
        dict of str to ndarray, shape (B,)
        """
        # A step that was counted is not counted again; what an episode begins with, only there.
        old, first, count = steps == self._at, steps <= 1, np.maximum(steps, 1)
        again, begins = np.count_nonzero(old) > 0, np.count_nonzero(first) > 0
        told = {}
        for name, over in self._over.items():
            kept, value = self._kept[name], now[name]
            if over in ("mean", "rms"):
                value = value * value if over == "rms" else value
                kept = kept + (np.where(old, 0.0, value) if again else value)
                if begins:
                    kept = np.where(first, value, kept)
                told[name] = np.sqrt(kept / count) if over == "rms" else kept / count
            else:
                kept = np.minimum(kept, value) if over == "least" else np.maximum(kept, value)
                if begins:
                    kept = np.where(steps == 0, value, kept)
                told[name] = kept - value if over == "fall" else kept.copy()
            self._kept[name] = kept
        self._at = steps.copy()
        return told

    def get_state(self) -> dict[str, Any]:
        """Return a copy of what is kept."""
        return {"kept": {k: v.copy() for k, v in self._kept.items()}, "at": self._at.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to it."""
        self._kept = {k: v.copy() for k, v in state["kept"].items()}
        self._at = state["at"].copy()
