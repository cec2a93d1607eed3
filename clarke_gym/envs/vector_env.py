"""The vector environment: the batched core with Gymnasium's autoreset modes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from clarke_gym.envs._shared import check_options, check_render_mode, goal_reward, render_rows
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.envs.env import ContinuumRobotEnv
from clarke_gym.envs.limits import Reading
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_choice, check_count
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Task

BoolArray = NDArray[np.bool_]

AUTORESET_MODES = {
    "next_step": AutoresetMode.NEXT_STEP,
    "same_step": AutoresetMode.SAME_STEP,
    "disabled": AutoresetMode.DISABLED,
}


class ContinuumRobotVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """A batch of tendon-driven continuum robots in raw joint space.

    Sub-environment i owns its generator (seed + i) and equals the scalar environment of that seed
    bit for bit.

    Parameters
    ----------
    config : EnvConfig
    num_envs : int
        Batch size B, at least 1.
    max_episode_steps : int, optional
        Steps after which an episode is truncated; no limit by default.
    autoreset_mode : {"next_step", "same_step", "disabled"}
        When an ended episode starts again; "disabled" leaves it to
        ``reset(options={"reset_mask": ...})``.
    render_mode : str, optional

    Raises
    ------
    ValueError
        If an argument is out of range; the message names it and what is allowed.
    """

    def __init__(
        self,
        config: EnvConfig,
        num_envs: int,
        max_episode_steps: int | None = None,
        autoreset_mode: str = "next_step",
        render_mode: str | None = None,
    ) -> None:
        for name, value in (("num_envs", num_envs), ("max_episode_steps", max_episode_steps)):
            if value is not None:
                check_count(name, value)
        check_choice("autoreset_mode", autoreset_mode, tuple(AUTORESET_MODES))
        self.autoreset_mode = AUTORESET_MODES[autoreset_mode]
        self.metadata = {
            **ContinuumRobotEnv.metadata,
            "render_fps": config.render_fps,
            "autoreset_mode": self.autoreset_mode,
        }
        check_render_mode(render_mode, self.metadata["render_modes"])
        self.render_mode = render_mode
        self.num_envs = num_envs
        self.max_episode_steps = max_episode_steps
        self.core = EnvCore(config, num_envs)
        self.single_action_space = self.core.reader.space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.single_observation_space = self.core.observation_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._done = np.zeros(num_envs, dtype=bool)
        self._all = np.arange(num_envs)

    @property
    def robot(self) -> Robot:
        """The robot's description."""
        return self.core.robot

    @property
    def task(self) -> Task:
        """What is asked of the robot."""
        return self.core.task

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Start new episodes.

        Parameters
        ----------
        seed : int or sequence, optional
            An int gives sub-environment i the seed + i; a sequence gives one entry each.
        options : dict, optional
            ``reset_mask``: bool array (B,), the environments to reset; all by default.
            ``goal``: goals in SI units, for the environments that are reset.

        Returns
        -------
        observations, infos

        Raises
        ------
        gymnasium.error.ResetNeeded
            If ``reset_mask`` leaves environments out that have never been reset.
        """
        options = dict(options or {})
        mask = self._check_mask(options.pop("reset_mask", None))
        rows = self._all[mask]
        if len(rows) < self.num_envs and not self.core.begun:
            raise ResetNeeded("the first reset must be of all environments, without 'reset_mask'")
        for index, value in zip(rows, self._check_seed(seed)[mask], strict=True):
            if value is not None:
                self.core.streams.seed(int(index), int(value))
        self.core.reset(rows, check_options(options, self.core.task.goal_size, len(rows)))
        self._done[rows] = False
        _, info = self.core.reward()
        return self.core.observe(), self._masked(info, mask)

    def step(
        self, actions: ArrayLike | Reading
    ) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Advance all environments by one control period under joint-space actions.

        Parameters
        ----------
        actions : array_like, shape (B, N)
            As in the scalar environment.

        Returns
        -------
        observations, rewards, terminations, truncations, infos

        Raises
        ------
        ValueError
            If the actions have another shape or are not finite.
        RuntimeError
            If an episode has ended and autoreset is disabled.
        gymnasium.error.ResetNeeded
            Before the first reset.
        """
        reading = actions if isinstance(actions, Reading) else self.core.reader.read(actions)
        ended = self._done
        if self.autoreset_mode is AutoresetMode.DISABLED and ended.any():
            raise RuntimeError(
                f"environments {self._all[ended].tolist()} have ended; reset them with "
                "options={'reset_mask': ...} before the next step"
            )
        self.core.step(reading)
        restart = (
            self._all[ended] if self.autoreset_mode is AutoresetMode.NEXT_STEP else self._all[:0]
        )
        if len(restart):
            self.core.reset(restart)
        reward, info = self.core.reward()
        terminated = info["diverged"]
        truncated = np.zeros(self.num_envs, dtype=bool)
        if self.max_episode_steps is not None:
            truncated = self.core.steps >= self.max_episode_steps
        if len(restart):
            reward[restart] = 0.0
        infos = self._masked(info, None)
        self._done = terminated | truncated
        observation = self.core.observe()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._done.any():
            rows = self._all[self._done]
            infos["final_obs"] = self._final_observation(observation, rows)
            infos["final_info"] = self._masked(info, self._done)
            infos["_final_obs"] = infos["_final_info"] = self._done
            self.core.reset(rows)
            self._done = np.zeros(self.num_envs, dtype=bool)
            infos.update(self._masked(self.core.reward()[1], None))
            observation = self.core.observe()
        return observation, reward, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Return one picture an environment, as Gymnasium's recorders tile them."""
        return render_rows(self.core, self.render_mode, range(self.num_envs)) or None

    def close_extras(self, **kwargs: Any) -> None:
        """Free what pictures hold."""
        del kwargs
        self.core.close()

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward of goals as observed; any leading shape (for hindsight replay)."""
        del info  # the reward depends on the goals alone
        return goal_reward(self.core, achieved_goal, desired_goal)

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return {**self.core.state(), "done": self._done.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self.core.restore(state)
        self._done = state["done"].copy()

    def _final_observation(self, batch: Any, rows: NDArray[np.intp]) -> NDArray[Any]:
        """Gymnasium's form: an object array with the last observation where an episode ended."""
        final = np.full(self.num_envs, None, dtype=object)
        for row in rows:
            if isinstance(batch, dict):
                final[row] = {name: array[row].copy() for name, array in batch.items()}
            else:
                final[row] = batch[row].copy()
        return final

    def _masked(self, info: dict[str, Any], mask: BoolArray | None) -> dict[str, Any]:
        """Add Gymnasium's ``_name`` masks, which tell the rows that hold a value."""
        given = np.ones(self.num_envs, dtype=bool) if mask is None else mask
        return {**info, **{f"_{name}": given for name in info}}

    def _check_mask(self, mask: Any) -> BoolArray:
        if mask is None:
            return np.ones(self.num_envs, dtype=bool)
        if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_:
            raise TypeError(f"options['reset_mask'] must be a bool array, got {mask!r}")
        if mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"options['reset_mask'] must have the shape ({self.num_envs},) and at least one "
                f"True, got {mask!r}"
            )
        return mask

    def _check_seed(self, seed: int | Sequence[int | None] | None) -> NDArray[Any]:
        seeds: list[int | None]
        if seed is None or isinstance(seed, int | np.integer):
            seeds = [None if seed is None else int(seed) + i for i in range(self.num_envs)]
        else:
            seeds = list(seed)
        if len(seeds) != self.num_envs:
            raise ValueError(f"seed must hold {self.num_envs} entries, got {len(seeds)}")
        return np.array(seeds, dtype=object)
