"""Copies of an environment on constant curvature, for planners to try actions on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Many


class Imagination:
    """Many copies of one environment without disturbances, with constant-curvature physics.

    Parameters
    ----------
    config : EnvConfig
        Of the environment.
    samples : int
        Copies.

    Raises
    ------
    ValueError
        If the task needs what constant curvature does not have.

    Examples
    --------
    >>> imagined = Imagination(EnvConfig.from_keywords(representation="clarke"), 4)
    >>> imagined.begin(np.array([0.1, 0.0, 0.15]), 0, np.zeros((1, 2)), np.zeros((1, 2)))
    >>> imagined.returns(np.zeros((5, 4, 2))).shape
    (4,)
    """

    def __init__(self, config: EnvConfig, samples: int) -> None:
        simple = replace(
            config,
            physics="constant_curvature",
            physics_options={},
            disturbances=None,
            sensors="command",
        )
        self._core = EnvCore(simple, Many(samples))
        self.samples, self.action_size = samples, self._core.actions.representation.size

    def begin(
        self,
        parameters: FloatArray,
        steps: int,
        command: FloatArray,
        displacement: FloatArray,
        *,
        bodies: FloatArray | None = None,
        difficulty: float | None = None,
    ) -> None:
        """Put all copies where an environment is.

        Parameters
        ----------
        parameters : ndarray, shape (p,)
            What tells its episode, see `Face.parameters`.
        steps : int
            Control periods since that began.
        command, displacement : ndarray, shape (S, 2)
            Clarke coordinates of command and displacement [m].
        bodies : ndarray, shape (K, 7), optional
            Where the bodies of a placed scene are [m]; by default where the task puts them.
        difficulty : float, optional
            The environment's of now; by default it stays what it was.
        """
        if difficulty not in (None, self._core.task.difficulty):
            self._core.set_difficulty(difficulty)
        self._core.begin_at(parameters, steps, command, displacement, bodies)

    def returns(self, actions: FloatArray, last: float = 1.0) -> FloatArray:
        """Return the sums of rewards under sequences of actions.

        Parameters
        ----------
        actions : ndarray, shape (H, samples, K)
        last : float
            Weight of the last reward.

        Returns
        -------
        ndarray, shape (samples,)
            A copy that fails gets no more rewards.
        """
        total, alive = np.zeros(self.samples), np.ones(self.samples, dtype=bool)
        for k, action in enumerate(actions):
            self._core.step(action)
            outcome = self._core.outcome()
            if outcome.failure is not None:
                alive &= ~outcome.failure
            weight = last if k == len(actions) - 1 else 1.0
            total += weight * np.where(alive, outcome.reward, 0.0)
        return total
