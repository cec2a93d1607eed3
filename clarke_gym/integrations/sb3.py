"""Stable-Baselines3: a clarke_gym vector environment as a `VecEnv`, stepped as one batch.

Importing this module needs Stable-Baselines3 (the extra ``sb3``); the rest of clarke_gym does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

import clarke_gym  # noqa: F401  (registers the environments)

try:
    from stable_baselines3.common.vec_env import VecEnv
    from stable_baselines3.common.vec_env.base_vec_env import (
        VecEnvIndices,
        VecEnvObs,
        VecEnvStepReturn,
    )
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(
        f"clarke_gym.integrations.sb3 needs Stable-Baselines3 ({error}): "
        'pip install "clarke_gym[sb3]"',
        name=error.name,
    ) from error


def make_sb3_vec_env(id: str, num_envs: int = 1, **kwargs: Any) -> Sb3VecEnv:
    """Return environments that Stable-Baselines3 trains in, stepped as one batch.

    Parameters
    ----------
    id : str
        A registered id, e.g. "clarke_gym/Reach-v0".
    num_envs : int
        Number of environments.
    **kwargs
        Keyword arguments of `gymnasium.make_vec`, e.g. ``n_tendons``, ``representation``.

    Returns
    -------
    Sb3VecEnv
        Bit for bit what SB3's `DummyVecEnv` makes of as many scalar environments.

    Raises
    ------
    TypeError, ValueError
        If a keyword is unknown or its value impossible; ``autoreset_mode`` is the adapter's own.

    Examples
    --------
    >>> vec_env = make_sb3_vec_env(
    ...     "clarke_gym/Reach-v0", num_envs=4, n_tendons=7, representation="clarke"
    ... )
    >>> vec_env.num_envs, vec_env.action_space.shape
    (4, (2,))
    >>> observation = vec_env.reset()
    >>> observation, reward, done, infos = vec_env.step(np.zeros((4, 2), np.float32))
    >>> reward.shape
    (4,)
    """
    env = gym.make_vec(id, num_envs=num_envs, autoreset_mode="disabled", **kwargs)
    return Sb3VecEnv(env)


class Sb3VecEnv(VecEnv):
    """Step a Gymnasium vector environment under SB3's conventions.

    SB3 resets an ended environment in the same step and wants its last observation in `info`.
    The environment therefore runs with autoreset disabled and is reset here through its mask.
    Infos are filled where an episode ends, where SB3 reads them, and are empty elsewhere: a
    dictionary for every robot and step would cost more than the step.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        With ``autoreset_mode="disabled"``.

    Raises
    ------
    ValueError
        If the environment resets itself.
    """

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        if env.metadata.get("autoreset_mode") is not AutoresetMode.DISABLED:
            raise ValueError('env must be made with autoreset_mode="disabled"')
        self.env = env
        self._actions: NDArray[Any] = np.empty(0)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> VecEnvObs:
        """Reset every environment with the seeds and options that were set for this once.

        Raises
        ------
        ValueError
            If `set_options` gave environments options of different names.
        """
        observation, info = self.env.reset(
            seed=self._seeds,  # type: ignore[arg-type]
            options=self._stacked_options(),
        )
        self.reset_infos = [_row(info, i) for i in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        result: VecEnvObs = observation
        return result

    def step_async(self, actions: NDArray[Any]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Step, and reset what ended."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if done.any():
            for i in np.flatnonzero(done).tolist():
                infos[i] = _row(info, i)
                infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
                infos[i]["terminal_observation"] = _index(observation, i)
            observation, info = self.env.reset(options={"reset_mask": done})
            for i in np.flatnonzero(done).tolist():
                self.reset_infos[i] = _row(info, i)
        return observation, reward.astype(np.float32), done, infos

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Return a picture of each environment."""
        return self.env.render() or ()  # type: ignore[return-value]

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the environment, once for each index."""
        return [getattr(self.env.unwrapped, attr_name)] * len(self._indices(indices))

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the whole environment."""
        if len(self._indices(indices)) != self.num_envs:
            raise ValueError("attributes are shared: set_attr needs all indices")
        setattr(self.env.unwrapped, attr_name, value)

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Return what a method of the environment returns, once for each index.

        It is called once, and acts on all environments.
        """
        result = getattr(self.env.unwrapped, method_name)(*method_args, **method_kwargs)
        return [result] * len(self._indices(indices))

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False: no scalar wrapper is inside a batched environment."""
        del wrapper_class
        return [False] * len(self._indices(indices))

    def _stacked_options(self) -> dict[str, Any] | None:
        """Return the options of all environments as the batch takes them: a row each."""
        first, *others = (dict(options) for options in self._options)
        if any(other.keys() != first.keys() for other in others):
            raise ValueError(f"options must have the same names for all, got {self._options!r}")
        if not first:
            return None
        return {name: np.stack([options[name] for options in self._options]) for name in first}

    def _indices(self, indices: VecEnvIndices) -> Sequence[int]:
        return list(self._get_indices(indices))


def _index(observation: Any, i: int) -> Any:
    if isinstance(observation, dict):
        return {name: array[i] for name, array in observation.items()}
    return observation[i]


def _row(info: dict[str, Any], i: int) -> dict[str, Any]:
    return {name: array[i] for name, array in info.items() if not name.startswith("_")}
