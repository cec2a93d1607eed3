"""Wrappers that change how a policy writes actions and reads joint space."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike

from clarke_gym.representations import Representation
from clarke_gym.wrappers.codec import ActionCodec, ObservationCodec
from clarke_gym.wrappers.goals import AsksRewards


class RepresentationAction(AsksRewards, gym.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Act in a representation of joint space.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    representation : str
        A name of `clarke_gym.representations.representation_names()`.

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
        self._codec = ActionCodec(env, representation, type(self).__name__)
        self.action_space = self._codec.space

    @property
    def representation(self) -> Representation:
        """The maps between actions and joint space."""
        return self._codec.representation

    def action(self, action: ArrayLike) -> Any:
        """Return the joint-space action."""
        return self._codec.decode(action)


class RepresentationObservation(
    AsksRewards, gym.ObservationWrapper[Any, Any, Any], RecordConstructorArgs
):
    """Observe joint space in a representation.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    representation : str
        A name of `clarke_gym.representations.representation_names()`.

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
        self._codec = ObservationCodec(env, representation, type(self).__name__)
        self.observation_space = self._codec.space(env.observation_space)

    @property
    def representation(self) -> Representation:
        """The maps between observed numbers and joint space."""
        return self._codec.representation

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
        RecordConstructorArgs.__init__(self)  # the first record stays: a spec names no argument
        super().__init__(env, "clarke")


class ClarkeObservation(RepresentationObservation, RecordConstructorArgs):
    """Observe joint space in Clarke coordinates: two numbers a segment and joint block.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        RecordConstructorArgs.__init__(self)  # the first record stays: a spec names no argument
        super().__init__(env, "clarke")
