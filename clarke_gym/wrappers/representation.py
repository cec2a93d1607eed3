"""Wrappers that change how a policy writes actions and reads joint space."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike

from clarke_gym.envs.codecs import ActionCodec, ObservationCodec
from clarke_gym.representations.registry import Representation
from clarke_gym.wrappers._core import core_of, hands_through


def _forward_compute_reward(wrapper: gym.Wrapper[Any, Any, Any, Any]) -> None:
    """Goal environments are asked for rewards through their wrappers, too."""
    if hasattr(wrapper.unwrapped, "compute_reward"):
        wrapper.compute_reward = wrapper.unwrapped.compute_reward  # type: ignore[attr-defined]


class RepresentationAction(gym.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Act in a representation of joint space.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    representation : str
        A name of `clarke_gym.representations.registry.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> env = RepresentationAction(gymnasium.make("clarke_gym/Reach-v0", n_tendons=7), "clarke")
    >>> env.action_space.shape
    (2,)
    """

    def __init__(self, env: gym.Env[Any, Any], representation: str) -> None:
        RecordConstructorArgs.__init__(self, representation=representation)
        gym.ActionWrapper.__init__(self, env)
        self._codec = ActionCodec(core_of(env, type(self).__name__), representation)
        self.action_space = self._codec.space
        direct = hands_through(env)
        self._translate: Callable[[Any], Any] = self._codec.read if direct else self._codec.decode
        _forward_compute_reward(self)

    @property
    def representation(self) -> Representation:
        """The maps between actions and joint space."""
        return self._codec.representation

    def step(self, action: ArrayLike) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Advance; a core within reach takes the action without a detour by joint space."""
        return self.env.step(self._translate(action))

    def action(self, action: ArrayLike) -> Any:
        """Return the joint-space action."""
        return self._codec.decode(action)


class RepresentationObservation(gym.ObservationWrapper[Any, Any, Any], RecordConstructorArgs):
    """Observe joint space in a representation.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    representation : str
        A name of `clarke_gym.representations.registry.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> env = gymnasium.make("clarke_gym/Reach-v0", n_tendons=7)
    >>> env.observation_space.shape
    (23,)
    >>> RepresentationObservation(env, "clarke").observation_space.shape
    (13,)
    """

    def __init__(self, env: gym.Env[Any, Any], representation: str) -> None:
        RecordConstructorArgs.__init__(self, representation=representation)
        gym.ObservationWrapper.__init__(self, env)
        core = core_of(env, type(self).__name__)
        self._codec = ObservationCodec(core, representation)
        self.observation_space = self._codec.space(env.observation_space)
        self._direct = hands_through(env, RepresentationAction, ClarkeAction)
        _forward_compute_reward(self)

    @property
    def representation(self) -> Representation:
        """The maps between observed numbers and joint space."""
        return self._codec.representation

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; a core within reach writes the observation itself."""
        if self._direct:
            restart = partial(self.env.reset, seed=seed, options=options)
            result: Any = self._codec.during(restart)
            return result[0], result[1]
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> Any:
        """Advance; see `reset`."""
        return self._codec.during(self.env.step, action) if self._direct else super().step(action)

    def observation(self, observation: Any) -> Any:
        """Return the observation with its joint blocks encoded."""
        return self._codec.encode(observation)


class ClarkeAction(RepresentationAction, RecordConstructorArgs):
    """Act in Clarke coordinates: two numbers a segment, whatever the number of tendons.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env, "clarke")
        RecordConstructorArgs.__init__(self)


class ClarkeObservation(RepresentationObservation, RecordConstructorArgs):
    """Observe joint space in Clarke coordinates: two numbers a segment and joint block.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env, "clarke")
        RecordConstructorArgs.__init__(self)
