"""Vector twins of the representation wrappers.

Gymnasium's own vector observation wrapper refuses the SAME_STEP mode; these encode the final
observations, too, so all modes work.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import batch_space

from clarke_gym.envs.codecs import ActionCodec, ObservationCodec
from clarke_gym.representations.registry import Representation
from clarke_gym.wrappers._core import core_of, hands_through

_VectorEnv = gym.vector.VectorEnv[Any, Any, Any]


class RepresentationAction(gym.vector.VectorWrapper):
    """Act in a representation of joint space.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        A clarke_gym vector environment.
    representation : str
        A name of `clarke_gym.representations.registry.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.
    """

    def __init__(self, env: _VectorEnv, representation: str) -> None:
        super().__init__(env)
        self._codec = ActionCodec(core_of(env, type(self).__name__), representation)
        self.single_action_space = self._codec.space
        self.action_space = batch_space(self._codec.space, self.num_envs)
        direct = hands_through(env)
        self._translate: Callable[[Any], Any] = self._codec.read if direct else self._codec.decode

    @property
    def representation(self) -> Representation:
        """The maps between actions and joint space."""
        return self._codec.representation

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance; a core within reach takes actions without a detour by joint space."""
        return self.env.step(self._translate(actions))


class RepresentationObservation(gym.vector.VectorWrapper):
    """Observe joint space in a representation.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        A clarke_gym vector environment.
    representation : str
        A name of `clarke_gym.representations.registry.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.
    """

    def __init__(self, env: _VectorEnv, representation: str) -> None:
        super().__init__(env)
        core = core_of(env, type(self).__name__)
        self._codec = ObservationCodec(core, representation)
        self.single_observation_space = self._codec.space(env.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._direct = hands_through(env, RepresentationAction, ClarkeAction)

    @property
    def representation(self) -> Representation:
        """The maps between observed numbers and joint space."""
        return self._codec.representation

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Reset and encode; a core within reach writes the observations itself."""
        if self._direct:
            restart = partial(self.env.reset, seed=seed, options=options)
            result: Any = self._codec.during(restart)
            return result[0], result[1]
        observation, info = self.env.reset(seed=seed, options=options)
        return self._codec.encode(observation), info

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance and encode, final observations included; see `reset`."""
        if self._direct:
            result: Any = self._codec.during(self.env.step, actions)
            return result
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if "final_obs" in info:
            final = np.full(self.num_envs, None, dtype=object)
            for row in np.flatnonzero(info["_final_obs"]):
                final[row] = self._codec.encode(info["final_obs"][row])
            info["final_obs"] = final
        return self._codec.encode(observation), reward, terminated, truncated, info


class ClarkeAction(RepresentationAction):
    """Act in Clarke coordinates: two numbers a segment, whatever the number of tendons."""

    def __init__(self, env: _VectorEnv) -> None:
        super().__init__(env, "clarke")


class ClarkeObservation(RepresentationObservation):
    """Observe joint space in Clarke coordinates: two numbers a segment and joint block."""

    def __init__(self, env: _VectorEnv) -> None:
        super().__init__(env, "clarke")
