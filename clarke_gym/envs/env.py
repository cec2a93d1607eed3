"""The scalar environment: a batch of one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from clarke_gym.envs._shared import (
    RENDER_MODES,
    check_options,
    check_render_mode,
    goal_reward,
    render_rows,
)
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.envs.limits import Reading
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Task

_ROW = np.array([0])


class ContinuumRobotEnv(gym.Env[Any, NDArray[np.float32]]):
    """One tendon-driven continuum robot in raw joint space.

    Wrappers change the representation; see `clarke_gym.wrappers`.

    Parameters
    ----------
    config : EnvConfig
    render_mode : str, optional
    """

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 20}  # noqa: RUF012

    def __init__(self, config: EnvConfig, render_mode: str | None = None) -> None:
        self.core = EnvCore(config, 1, scalar=True)
        self.metadata = {**self.metadata, "render_fps": config.render_fps}
        check_render_mode(render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.action_space = self.core.reader.space
        self.observation_space = self.core.observation_space()

    @property
    def robot(self) -> Robot:
        """The robot's description."""
        return self.core.robot

    @property
    def task(self) -> Task:
        """What is asked of the robot."""
        return self.core.task

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start a new episode.

        Parameters
        ----------
        seed : int, optional
            Gives the environment a new generator.
        options : dict, optional
            ``goal``: the goal in SI units instead of a random one.

        Returns
        -------
        observation, info
        """
        streams = self.core.streams
        if seed is not None or streams.generators[0] is None:
            streams.seed(0, seed)
            self._np_random_seed = streams.seeds[0]
        self._np_random = streams.generators[0]
        self.core.reset(_ROW, check_options(options, self.core.task.goal_size, 1))
        _, info = self.core.reward()
        return self.core.observe(), info

    def step(self, action: ArrayLike | Reading) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control period under a joint-space action.

        Parameters
        ----------
        action : array_like, shape (N,)
            One number a tendon; 1 is the speed limit or, in absolute control, the largest
            displacement. Larger numbers saturate. The representation wrappers hand over what
            they have read already.

        Returns
        -------
        observation, reward, terminated, truncated, info

        Raises
        ------
        ValueError
            If the action has another shape or is not finite.
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        core = self.core
        core.step(action if isinstance(action, Reading) else core.reader.read(action))
        reward, info = core.reward()
        return core.observe(), reward, info["diverged"], False, info

    def render(self) -> Any:
        """Return the picture (height, width, 3) uint8, or the depth (height, width) float32 [m].

        Returns
        -------
        ndarray or None
            None without a render mode.

        Raises
        ------
        RuntimeError
            If the machine has no off-screen OpenGL; the message names what to install.
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        frames = render_rows(self.core, self.render_mode, [0])
        return frames[0] if frames else None

    def close(self) -> None:
        """Free what pictures hold; a second call does nothing."""
        self.core.close()

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return self.core.state()

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self.core.restore(state)
        self._np_random = self.core.streams.generators[0]
        self._np_random_seed = self.core.streams.seeds[0]


class ContinuumRobotGoalEnv(ContinuumRobotEnv):
    """The same robot with dictionary observations and a reward that can be asked of any goals."""

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward of goals as observed; any leading shape (for hindsight replay)."""
        del info  # the reward depends on the goals alone
        return goal_reward(self.core, achieved_goal, desired_goal)
