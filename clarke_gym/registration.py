"""The table of environment ids, and the entry points that compose environments by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import gymnasium as gym

from clarke_gym.envs import (
    ContinuumRobotEnv,
    ContinuumRobotGoalEnv,
    ContinuumRobotVectorEnv,
    EnvConfig,
)

ENVIRONMENTS: dict[str, dict[str, Any]] = {
    "clarke_gym/Reach-v0": {"task": "reach"},
    "clarke_gym/Pose-v0": {"task": "pose", "robot": "two_segment"},
    "clarke_gym/Track-v0": {"task": "track"},
    "clarke_gym/Shape-v0": {"task": "shape", "robot": "two_segment"},
    "clarke_gym/Gate-v0": {"task": "gate"},
    "clarke_gym/Nest-v0": {"task": "nest", "robot": "two_segment"},
    "clarke_gym/Hold-v0": {"task": "hold", "physics": "mujoco"},
    "clarke_gym/Wrap-v0": {
        "task": "wrap",
        "physics": "mujoco",
        "robot": "two_segment",
        "max_bending_rad": 3.0,
    },
    "clarke_gym/Task-v0": {},
}
"""Id -> keyword arguments. "clarke_gym/Task-v0" takes any task by name: ``task="mine"``."""


def make_env(*, render_mode: str | None = None, **keywords: Any) -> Any:
    """Return a scalar environment; the entry point of every id.

    Parameters
    ----------
    render_mode : str, optional
        "rgb_array" or "depth_array"; `gymnasium.make` adds "rgb_array_list" (all pictures since the
        last call) and "human" (a window; needs pygame, the extra ``human``).
    **keywords
        The fields of `clarke_gym.envs.EnvConfig`, and the keyword arguments of the robot
        (`clarke_gym.robots.make_robot`), the task and the physics.

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
    config = EnvConfig.from_keywords(**keywords)
    env_class = ContinuumRobotGoalEnv if config.goal_env else ContinuumRobotEnv
    if render_mode == "human":
        return gym.wrappers.HumanRendering(env_class(config, "rgb_array"))
    if render_mode == "rgb_array_list":
        return gym.wrappers.RenderCollection(env_class(config, "rgb_array"))
    return env_class(config, render_mode)


def make_vector_env(
    *,
    num_envs: int = 1,
    max_episode_steps: int | None = None,
    autoreset_mode: Any = "next_step",
    render_mode: str | None = None,
    **keywords: Any,
) -> Any:
    """Return a vector environment; the vector entry point of every id.

    Parameters
    ----------
    num_envs : int
        Number of environments.
    max_episode_steps : int, optional
        Gymnasium's name for a time limit that shortens episodes; `episode_steps` sets any.
    autoreset_mode : {"next_step", "same_step", "disabled"} or gymnasium.vector.AutoresetMode
        When an ended episode starts again.
    render_mode : str, optional
        "rgb_array" or "depth_array".
    **keywords
        As in `make_env`.

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
    config = EnvConfig.from_keywords(**keywords)
    if max_episode_steps is not None:
        longest = config.longest_episode
        if not isinstance(max_episode_steps, int) or not 1 <= max_episode_steps <= longest:
            raise ValueError(
                f"max_episode_steps must be a whole number from 1 to {longest}, got "
                f"{max_episode_steps!r}; episode_steps makes episodes longer"
            )
        config = replace(config, episode_steps=max_episode_steps)
    return ContinuumRobotVectorEnv(config, num_envs, autoreset_mode, render_mode)


def register_environments() -> None:
    """Register every id once; a second import changes nothing.

    Examples
    --------
    >>> register_environments()
    >>> "clarke_gym/Reach-v0" in gym.registry
    True
    """
    for name, keywords in ENVIRONMENTS.items():
        if name not in gym.registry:
            gym.register(
                name,
                entry_point="clarke_gym.registration:make_env",
                vector_entry_point="clarke_gym.registration:make_vector_env",
                disable_env_checker=True,  # our tests run the full one on every environment
                order_enforce=False,  # the core refuses steps before the first reset itself
                kwargs=keywords,  # no max_episode_steps: the clock is inside, and in state()
            )
