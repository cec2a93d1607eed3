"""Noise on observations."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from clarke_gym.numerics.checks import check_not_negative
from clarke_gym.numerics.noise import normals
from clarke_gym.wrappers.codec import face_of, place_of
from clarke_gym.wrappers.goals import AsksRewards

_STREAM = 0x6E6F697365
"""Keeps what seeds noise apart from what seeds episodes."""


class Noise:
    """White noise on the observations of B environments, each with a seed of its own.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    space : gymnasium.Space
        Of one environment's observations.
    num_envs : int
    deviation : float
        Standard deviation, in the unit of observations.
    sensors : str or None
        Names with "+" between them; None for every entry.

    Raises
    ------
    ValueError, TypeError
        If a number or name is impossible.
    """

    def __init__(
        self, env: Any, space: Any, num_envs: int, deviation: float, sensors: str | None
    ) -> None:
        check_not_negative("deviation", deviation)
        box = space["observation"] if isinstance(space, gym.spaces.Dict) else space
        if not isinstance(box, gym.spaces.Box):
            raise TypeError(f"noise needs observations of numbers, got the space {box!r}")
        self._low, self._high = box.low, box.high
        self._deviation = np.full(box.shape, deviation)
        if sensors is not None:
            blocks = face_of(env, "NoisyObservation").sensors
            names = [name.strip() for name in sensors.split("+")]
            for name in names:
                if name not in blocks:
                    raise ValueError(f"sensors must be of {list(blocks)}, got {name!r}")
            places = {name: place_of(env, block) for name, block in blocks.items()}
            width = max(place.stop for place in places.values())
            if box.shape[-1] != width:
                raise ValueError(
                    f"sensors need observations as the environment writes them, {width} numbers "
                    f"wide; a wrapper below makes them {box.shape[-1]} wide: put noise on first"
                )
            quiet = np.ones(width, dtype=bool)
            for name in names:
                quiet[places[name]] = False
            self._deviation[..., quiet] = 0.0
        self._keys = np.random.default_rng().random(num_envs)
        self._count = np.zeros(num_envs, dtype=np.int64)

    def seed(self, row: int, seed: int) -> None:
        """Begin the noise of an environment anew."""
        self._keys[row] = np.random.default_rng((seed, _STREAM)).random()
        self._count[row] = 0

    def added(self, rows: NDArray[np.intp], observation: Any) -> Any:
        """Return observations of some environments (R, ...) with noise, within their space."""
        if isinstance(observation, dict):
            return {**observation, "observation": self.added(rows, observation["observation"])}
        size = observation[0].size
        noise = normals(self._keys[rows], self._count[rows], size).reshape(observation.shape)
        self._count[rows] += 1
        told = observation + self._deviation * noise
        return np.clip(told, self._low, self._high).astype(observation.dtype)


class NoisyObservation(AsksRewards, gym.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """Observe with white noise, normal and seeded by `reset`.

    The disturbance "sensor_noise" does the same to what is measured and no more, inside `state()`;
    this wrapper takes any environment whose observations are numbers. Of goal environments goals
    stay as they are, so rewards can be asked of them.

    Parameters
    ----------
    env : gymnasium.Env
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
    >>> plain = gymnasium.make("clarke_gym/Reach-v0", representation="clarke")
    >>> noisy = NoisyObservation(plain, deviation=0.01, sensors="tip_position")
    >>> gap = noisy.reset(seed=1)[0] - plain.reset(seed=1)[0]
    >>> (gap != 0.0).astype(int)
    array([0, 0, 0, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0])
    """

    def __init__(
        self, env: gym.Env[Any, Any], deviation: float = 0.02, sensors: str | None = None
    ) -> None:
        RecordConstructorArgs.__init__(self, deviation=deviation, sensors=sensors)
        gym.ObservationWrapper.__init__(self, env)
        self._noise = Noise(env, env.observation_space, 1, deviation, sensors)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Reset; a seed begins the noise anew."""
        if seed is not None:
            self._noise.seed(0, seed)
        return super().reset(seed=seed, options=options)

    def observation(self, observation: Any) -> Any:
        """Return the observation with noise."""
        if isinstance(observation, dict):
            return {**observation, "observation": self.observation(observation["observation"])}
        return self._noise.added(np.array([0]), observation[None])[0]
