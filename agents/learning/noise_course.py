"""Exploration noise of a recorded size: an instrument that takes noise out of a comparison.

Two arms that learn under the same course of noise on the manifold can differ by something else
alone. The course comes from ``std_on`` in another run's ``diagnostics.npz``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from stable_baselines3.common.callbacks import BaseCallback


class NoiseCourse(BaseCallback):
    """Sets the noise of every rollout; it is no longer learnt.

    Parameters
    ----------
    course : sequence of (int, float)
        Environment steps, rising, and the root mean square length that the noise has there on the
        manifold, in Clarke coordinates. Between them its logarithm is linear; outside them it
        stays.
    onto : array_like, shape (d, K)
        M: Clarke coordinates of an action.

    Examples
    --------
    >>> course = NoiseCourse([(0, 1.0), (100, 0.25)], np.eye(2))
    >>> [round(math.exp(course.log_std(steps)) * math.sqrt(2), 4) for steps in (0, 50, 200)]
    [1.0, 0.5, 0.25]
    """

    def __init__(self, course: Sequence[tuple[int, float]], onto: ArrayLike) -> None:
        super().__init__()
        self._steps = [steps for steps, _ in course]
        self._log_lengths = [math.log(length) for _, length in course]
        self._log_gain = math.log(float(np.linalg.norm(np.asarray(onto, np.float64))))

    def log_std(self, steps: int) -> float:
        """Return the logarithm of the standard deviation of each number of an action.

        Parameters
        ----------
        steps : int
            Environment steps so far.
        """
        return float(np.interp(steps, self._steps, self._log_lengths)) - self._log_gain

    def _on_rollout_start(self) -> None:
        policy: Any = self.model.policy
        policy.log_std.requires_grad_(False).fill_(self.log_std(self.model.num_timesteps))

    def _on_step(self) -> bool:
        return True
