"""What vector wrappers have in common."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

VectorEnv: TypeAlias = gym.vector.VectorEnv[Any, Any, Any]


class Layer(gym.vector.VectorWrapper):
    """A layer that shows everything of the environment that it does not change."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "env":
            raise AttributeError(f"accessing private attribute {name!r} is prohibited")
        return getattr(self.env, name)


class EpisodeLayer(Layer):
    """A layer that knows where episodes begin, in every autoreset mode.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
    """

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env)
        self._mode = env.metadata["autoreset_mode"]
        self._ended = np.zeros(self.num_envs, dtype=bool)

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Reset, wholly or where ``options["reset_mask"]`` is true."""
        given = (options or {}).get("reset_mask")
        mask = np.ones(self.num_envs, dtype=bool) if given is None else given
        self._ended &= ~mask
        self.forget(mask, seed)
        observation, info = self.env.reset(seed=seed, options=options)
        # What is not reset is seen as it was.
        shown = self.seen(observation, mask) if mask.all() else self.again(observation, mask)
        return shown, info

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance; what ends an episode is seen as of it, what begins one as of the next."""
        begun = self._ended if self._mode is AutoresetMode.NEXT_STEP else np.zeros_like(self._ended)
        self.forget(begun)
        result = self.env.step(self.sent(actions))
        observation, reward, terminated, truncated, info = result
        self._ended = ended = terminated | truncated
        if self._mode is AutoresetMode.SAME_STEP and ended.any():
            rows = np.flatnonzero(ended)
            last = _replaced(observation, rows, info["final_obs"])
            info["final_obs"] = self._one_by_one(self.seen(last, begun), rows)
            self._ended = np.zeros_like(ended)
            self.forget(ended)
            shown = self.again(observation, ended)
        else:
            shown = self.seen(observation, begun)
        return shown, reward, terminated, truncated, info

    def forget(self, rows: NDArray[np.bool_], seed: Any = None) -> None:
        """Let new episodes begin where `rows` (B,) is true; `seed` is that of a reset."""

    def sent(self, actions: Any) -> Any:
        """Return what the environment is told of actions."""
        return actions

    def seen(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return what is seen of observations, the first of an episode where `begun` (B,)."""
        del begun
        return observation

    def again(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return what is seen where `begun`; the other rows were seen in this step already."""
        del begun
        return observation

    def _one_by_one(self, observation: Any, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Return Gymnasium's form of final observations: an object array, None elsewhere."""
        final = np.full(self.num_envs, None, dtype=object)
        for row in rows:
            final[row] = mapped(lambda part, row=row: part[row].copy(), observation)
        return final


class ObservationLayer(EpisodeLayer):
    """A layer of observations whose newest ones are kept, (B, kept, ...) of every array.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
    kept : int
    """

    def __init__(self, env: VectorEnv, kept: int) -> None:
        super().__init__(env)
        inner = env.single_observation_space
        if isinstance(inner, spaces.Dict):
            self._rings: Any = {name: self._ring(part, kept) for name, part in inner.items()}
        else:
            self._rings = self._ring(inner, kept)

    def _ring(self, space: Any, kept: int) -> NDArray[Any]:
        return np.zeros((self.num_envs, kept, *space.shape), space.dtype)

    def shows(self, space: spaces.Space[Any]) -> None:
        """Take the space of one environment's observations."""
        self.single_observation_space = space
        self.observation_space = batch_space(space, self.num_envs)

    def seen(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return what the newest observations show."""
        everywhere = np.ones(self.num_envs, dtype=bool)
        mapped(lambda ring, new: self._push(ring, new, everywhere, begun), self._rings, observation)
        return mapped(self.shown, self._rings)

    def again(self, observation: Any, begun: NDArray[np.bool_]) -> Any:
        """Return the same, with the first of new episodes."""
        mapped(lambda ring, new: self._push(ring, new, begun, begun), self._rings, observation)
        return mapped(self.shown, self._rings)

    def _push(
        self,
        ring: NDArray[Any],
        new: NDArray[Any],
        rows: NDArray[np.bool_],
        begun: NDArray[np.bool_],
    ) -> None:
        ring[rows] = np.roll(ring[rows], -1, axis=1)
        ring[begun] = self.before(new[begun])[:, None]
        ring[rows, -1] = new[rows]

    @abstractmethod
    def before(self, first: NDArray[Any]) -> NDArray[Any]:
        """Return what stands for observations before the first of an episode, both (R, ...)."""

    @abstractmethod
    def shown(self, ring: NDArray[Any]) -> NDArray[Any]:
        """Return, as a new array, what is shown of the newest observations (B, kept, ...)."""


def mapped(function: Any, *parts: Any) -> Any:
    """Return a function of arrays, or of each entry of dictionaries of arrays.

    Parameters
    ----------
    function : callable
    *parts : ndarray or dict of ndarray

    Returns
    -------
    ndarray or dict

    Examples
    --------
    >>> mapped(lambda x, y: x + y, {"a": 1}, {"a": 2})
    {'a': 3}
    """
    if not isinstance(parts[0], dict):
        return function(*parts)
    return {name: function(*(part[name] for part in parts)) for name in parts[0]}


def _replaced(observation: Any, rows: NDArray[np.intp], final: NDArray[Any]) -> Any:
    """Return observations whose `rows` are the final ones of ended episodes."""
    last = mapped(np.copy, observation)
    for row in rows:
        mapped(lambda part, one, row=row: part.__setitem__(row, one), last, final[row])
    return last
