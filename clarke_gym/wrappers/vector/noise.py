"""Vector twin of noise on observations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.checks import check_seeds
from clarke_gym.wrappers.noise import Noise
from clarke_gym.wrappers.vector.layer import EpisodeLayer, VectorEnv, mapped


class NoisyObservation(EpisodeLayer):
    """Observe with white noise: environment i as the scalar wrapper does of its seed.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
    deviation : float
        Standard deviation in the unit of observations, which robots' limits scale to about 1.
    sensors : str, optional
        Names of a clarke_gym environment's sensors with "+" between them; every entry by default.

    Raises
    ------
    ValueError, TypeError
        If a number or name is impossible.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> from clarke_gym import wrappers
    >>> keywords = {"n_tendons": 4, "representation": "clarke"}
    >>> env = wrappers.NoisyObservation(gymnasium.make("clarke_gym/Reach-v0", **keywords))
    >>> envs = gymnasium.make_vec("clarke_gym/Reach-v0", num_envs=2, **keywords)
    >>> many = NoisyObservation(envs).reset(seed=5)[0]
    >>> bool((many[1] == env.reset(seed=6)[0]).all())
    True
    """

    def __init__(self, env: VectorEnv, deviation: float = 0.02, sensors: str | None = None) -> None:
        super().__init__(env)
        space = env.single_observation_space
        self._noise = Noise(env, space, self.num_envs, deviation, sensors)

    def forget(self, rows: NDArray[np.bool_], seed: Any = None) -> None:
        """Begin the noise of seeded environments anew."""
        if seed is None:
            return
        for row, one in enumerate(check_seeds(seed, self.num_envs)):
            if rows[row] and one is not None:
                self._noise.seed(row, one)

    def seen(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return the observations with noise."""
        del begun
        self._last = self._noise.added(np.arange(self.num_envs), observation)
        return mapped(np.copy, self._last)

    def again(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return them with noise on the first of new episodes."""
        rows = np.flatnonzero(begun)
        fresh = self._noise.added(rows, mapped(lambda part: part[rows], observation))
        mapped(lambda part, new: part.__setitem__(rows, new), self._last, fresh)
        return mapped(np.copy, self._last)
