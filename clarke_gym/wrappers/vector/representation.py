"""Vector twins of the representation wrappers.

Gymnasium's own vector observation wrapper refuses the SAME_STEP mode; these encode the final
observations, too, so all modes work.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector.utils import batch_space

from clarke_gym.representations import Representation
from clarke_gym.wrappers.codec import ActionCodec, ObservationCodec
from clarke_gym.wrappers.vector.layer import Layer, VectorEnv


class RepresentationAction(Layer):
    """Act in a representation of joint space.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        A clarke_gym vector environment.
    representation : str
        A name of `clarke_gym.representations.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.
    """

    def __init__(self, env: VectorEnv, representation: str) -> None:
        super().__init__(env)
        self._codec = ActionCodec(env, representation, type(self).__name__)
        self.single_action_space = self._codec.space
        self.action_space = batch_space(self._codec.space, self.num_envs)

    @property
    def representation(self) -> Representation:
        """The maps between actions and joint space."""
        return self._codec.representation

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance under the joint-space actions."""
        return self.env.step(self._codec.decode(actions))


class RepresentationObservation(Layer):
    """Observe joint space in a representation.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        A clarke_gym vector environment.
    representation : str
        A name of `clarke_gym.representations.representation_names()`.

    Raises
    ------
    TypeError, ValueError
        If `env` is another environment, or the representation does not exist for its robot.
    """

    def __init__(self, env: VectorEnv, representation: str) -> None:
        super().__init__(env)
        self._codec = ObservationCodec(env, representation, type(self).__name__)
        self.single_observation_space = self._codec.space(env.single_observation_space)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    @property
    def representation(self) -> Representation:
        """The maps between observed numbers and joint space."""
        return self._codec.representation

    def reset(self, *, seed: Any = None, options: Any = None) -> tuple[Any, dict[str, Any]]:
        """Reset and encode."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._codec.encode(observation), info

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Advance and encode, final observations included."""
        observation, reward, terminated, truncated, info = self.env.step(actions)
        if "final_obs" in info:
            final = np.full(self.num_envs, None, dtype=object)
            for row in np.flatnonzero(info["_final_obs"]):
                final[row] = self._codec.encode(info["final_obs"][row])
            info["final_obs"] = final
        return self._codec.encode(observation), reward, terminated, truncated, info


class ClarkeAction(RepresentationAction):
    """Act in Clarke coordinates: two numbers a segment, whatever the number of tendons."""

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env, "clarke")


class ClarkeObservation(RepresentationObservation):
    """Observe joint space in Clarke coordinates: two numbers a segment and joint block."""

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env, "clarke")
