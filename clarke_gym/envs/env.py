"""The scalar environment: a batch of one."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.envs.face import Face, check_options
from clarke_gym.numerics.batch import One

_ROW = np.array([0])


class ContinuumRobotEnv(Face, gym.Env[Any, NDArray[np.float32]]):
    """One tendon-driven continuum robot.

    Parameters
    ----------
    config : EnvConfig
    render_mode : str, optional
    """

    def __init__(self, config: EnvConfig, render_mode: str | None = None) -> None:
        self._core = EnvCore(config, One())
        self._choose_rendering(render_mode)
        self.action_space: Any = self._core.action_space()
        self.observation_space = self._core.observation_space()

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
        core, episode = self._core, self._core.episode
        if seed is not None or episode.generators[0] is None:
            episode.seed(0, seed)
        self._share_generator()
        core.reset(_ROW, check_options(options, core.task.goal, 1, core.robot))
        _, _, info = core.evaluate()
        return core.observe(), {name: value[0] for name, value in info.items()}

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control period.

        Parameters
        ----------
        action : array_like, shape (K,)
            In the representation of actions. In joint space one number a tendon; 1 is the speed
            limit or, in absolute control, the largest displacement. Larger numbers saturate.

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
        core = self._core
        core.step(action)
        outcome, ended, info = core.evaluate()
        return (
            core.observe(),
            outcome.reward.item(),
            ended.item(),
            core.episode.truncated.item(),
            {name: value[0] for name, value in info.items()},
        )

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
        frames = self._frames([0])
        return frames[0] if frames else None

    def close(self) -> None:
        """Free what pictures hold; a second call does nothing."""
        self._core.close()

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        super().restore(state)
        self._share_generator()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Return from a pickle or a copy."""
        self.__dict__.update(state)
        self._share_generator()

    def _share_generator(self) -> None:
        """Let Gymnasium's face of the environment show the generator of its episodes."""
        self._np_random = self._core.episode.generators[0]
        self._np_random_seed = self._core.episode.seeds[0]


class ContinuumRobotGoalEnv(ContinuumRobotEnv):
    """The same robot with dictionary observations and a reward that can be asked of any goals."""

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward of goals as observed; any leading shape (for hindsight replay)."""
        del info  # the reward depends on the goals alone
        return self._core.goal_reward(achieved_goal, desired_goal)
