"""The table of environment ids, and the entry points that compose environment and wrappers."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from clarke_gym import wrappers
from clarke_gym.envs import (
    ContinuumRobotEnv,
    ContinuumRobotGoalEnv,
    ContinuumRobotVectorEnv,
    EnvConfig,
)
from clarke_gym.wrappers import vector as vector_wrappers

ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "clarke_gym/Reach-v0": {"max_episode_steps": 50, "kwargs": {"task": "reach"}},
}
"""Id -> what `gymnasium.register` needs beside the entry points."""


def _compose(
    env: Any, twins: Any, representation: str, action: str | None, observation: str | None
) -> Any:
    """Wrap `env` in its representations; raw needs no wrapper."""
    action = representation if action is None else action
    observation = representation if observation is None else observation
    if action != "raw":
        env = twins.RepresentationAction(env, action)
    if observation != "raw":
        env = twins.RepresentationObservation(env, observation)
    return env


def make_env(
    *,
    representation: str = "raw",
    action_representation: str | None = None,
    observation_representation: str | None = None,
    render_mode: str | None = None,
    **config: Any,
) -> Any:
    """Return a scalar environment; the entry point of every id.

    Parameters
    ----------
    representation : str
        Of actions and observations alike: a name of the registry in `clarke_gym.representations`.
    action_representation, observation_representation : str, optional
        One side only; `representation` where it is not given.
    render_mode : str, optional
        "rgb_array", "depth_array", or "human" (a window; needs pygame, the extra ``human``).
    **config
        The fields of `clarke_gym.envs.EnvConfig`.

    Returns
    -------
    gymnasium.Env

    Raises
    ------
    TypeError, ValueError
        If a keyword is unknown or its value impossible.

    Examples
    --------
    >>> import clarke_gym
    >>> env = gym.make("clarke_gym/Reach-v0", n_tendons=7, action_representation="clarke")
    >>> env.action_space.shape
    (2,)
    """
    settings = EnvConfig(**config)
    env_class = ContinuumRobotGoalEnv if settings.goal_env else ContinuumRobotEnv
    human = render_mode == "human"
    env = _compose(
        env_class(settings, "rgb_array" if human else render_mode),
        wrappers,
        representation,
        action_representation,
        observation_representation,
    )
    if human:  # a window that shows the picture; needs pygame
        env = gym.wrappers.HumanRendering(env)
    return env


def make_vector_env(
    *,
    num_envs: int = 1,
    representation: str = "raw",
    action_representation: str | None = None,
    observation_representation: str | None = None,
    max_episode_steps: int | None = None,
    autoreset_mode: str = "next_step",
    render_mode: str | None = None,
    **config: Any,
) -> Any:
    """Return a vector environment; the vector entry point of every id.

    Parameters
    ----------
    num_envs : int
        Number of environments.
    representation, action_representation, observation_representation : str
        As in `make_env`.
    max_episode_steps : int, optional
        Time limit; the id's own by default.
    autoreset_mode : {"next_step", "same_step", "disabled"}
        When an ended episode starts again.
    render_mode : str, optional
        One of the environment's render modes.
    **config
        The fields of `clarke_gym.envs.EnvConfig`.

    Returns
    -------
    gymnasium.vector.VectorEnv

    Raises
    ------
    TypeError, ValueError
        If a keyword is unknown or its value impossible.

    Examples
    --------
    >>> import clarke_gym
    >>> envs = gym.make_vec("clarke_gym/Reach-v0", num_envs=8, n_tendons=5, representation="clarke")
    >>> envs.action_space.shape
    (8, 2)
    """
    env = ContinuumRobotVectorEnv(
        EnvConfig(**config), num_envs, max_episode_steps, autoreset_mode, render_mode
    )
    return _compose(
        env, vector_wrappers, representation, action_representation, observation_representation
    )


def register_environments() -> None:
    """Register every id once; a second import changes nothing.

    Examples
    --------
    >>> register_environments()
    >>> "clarke_gym/Reach-v0" in gym.registry
    True
    """
    for name, entry in ENVIRONMENTS.items():
        if name not in gym.registry:
            gym.register(
                name,
                entry_point="clarke_gym.registration:make_env",
                vector_entry_point="clarke_gym.registration:make_vector_env",
                disable_env_checker=True,  # our tests run the full one on every environment
                order_enforce=False,  # the core refuses steps before the first reset itself
                **entry,
            )
