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

from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.envs.face import Face, check_options
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Many
from clarke_gym.numerics.checks import check_count, check_seeds
from clarke_gym.numerics.registry import nearest

BoolArray = NDArray[np.bool_]

AUTORESET_MODES = {
    "next_step": AutoresetMode.NEXT_STEP,
    "same_step": AutoresetMode.SAME_STEP,
    "disabled": AutoresetMode.DISABLED,
}
"""Gymnasium's modes by the names that keyword arguments may have."""


def _autoreset(mode: str | AutoresetMode) -> AutoresetMode:
    if isinstance(mode, AutoresetMode):
        return mode
    if mode not in AUTORESET_MODES:
        raise ValueError(
            f"autoreset_mode must be one of {list(AUTORESET_MODES)} or Gymnasium's AutoresetMode, "
            f"got {mode!r}{nearest(mode, AUTORESET_MODES)}"
        )
    return AUTORESET_MODES[mode]


class ContinuumRobotVectorEnv(Face, gym.vector.VectorEnv[Any, Any, Any]):
    """A batch of tendon-driven continuum robots.

    Sub-environment i owns its generator (seed + i) and equals the scalar environment of that seed
    bit for bit.

    Parameters
    ----------
    config : EnvConfig
    num_envs : int
        Batch size B, at least 1.
    autoreset_mode : {"next_step", "same_step", "disabled"} or AutoresetMode
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
        autoreset_mode: str | AutoresetMode = "next_step",
        render_mode: str | None = None,
    ) -> None:
        self.num_envs = check_count("num_envs", num_envs)
        self.autoreset_mode = _autoreset(autoreset_mode)
        self._core = EnvCore(config, Many(num_envs))
        self._choose_rendering(render_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}  # type: ignore[misc]
        self.single_action_space = self._core.action_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.single_observation_space = self._core.observation_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._done = np.zeros(num_envs, dtype=bool)
        self._all = np.arange(num_envs)

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
        core = self._core
        if len(rows) < self.num_envs and not core.episode.begun:
            raise ResetNeeded("the first reset must be of all environments, without 'reset_mask'")
        seeds = check_seeds(seed, self.num_envs)
        for index in rows.tolist():
            if seeds[index] is not None or core.episode.generators[index] is None:
                core.episode.seed(index, seeds[index])
        core.reset(rows, check_options(options, core.task.goal, len(rows), core.robot))
        self._done[rows] = False
        _, _, info = core.evaluate()
        return core.observe(), self._masked(info, mask)

    def step(
        self, actions: ArrayLike
    ) -> tuple[Any, FloatArray, BoolArray, BoolArray, dict[str, Any]]:
        """Advance all environments by one control period.

        Parameters
        ----------
        actions : array_like, shape (B, K)
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
        core, ended = self._core, self._done
        if self.autoreset_mode is AutoresetMode.DISABLED and ended.any():
            raise RuntimeError(
                f"environments {self._all[ended].tolist()} have ended; reset them with "
                "options={'reset_mask': ...} before the next step"
            )
        core.step(actions)
        restart = (
            self._all[ended] if self.autoreset_mode is AutoresetMode.NEXT_STEP else self._all[:0]
        )
        if len(restart):
            core.reset(restart)
        outcome, terminated, info = core.evaluate()
        reward, truncated = np.array(outcome.reward, np.float64), core.episode.truncated
        if len(restart):  # a step that begins an episode tells its first observation alone
            reward[restart], terminated[restart] = 0.0, False
        infos = self._masked(info, None)
        self._done = terminated | truncated
        observation = core.observe()
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._done.any():
            rows = self._all[self._done]
            infos["final_obs"] = self._final_observation(observation, rows)
            infos["final_info"] = self._masked(info, self._done)
            infos["_final_obs"], infos["_final_info"] = self._done, self._done.copy()
            core.reset(rows)
            self._done = np.zeros(self.num_envs, dtype=bool)
            infos.update(self._masked(core.evaluate()[2], None))
            observation = core.observe()
        return observation, reward, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """Return one picture an environment, as Gymnasium's recorders tile them."""
        return self._frames(range(self.num_envs)) or None

    def close_extras(self, **kwargs: Any) -> None:
        """Free what pictures hold."""
        del kwargs
        self._core.close()

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward of goals as observed; any leading shape (for hindsight replay)."""
        del info  # the reward depends on the goals alone
        return self._core.goal_reward(achieved_goal, desired_goal)

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return {**super().state(), "done": self._done.copy()}

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        super().restore(state)
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
        """Return copies with Gymnasium's ``_name`` masks, which tell the rows that hold a value."""
        given = np.ones(self.num_envs, dtype=bool) if mask is None else mask
        masks = {f"_{name}": given.copy() for name in info}
        return {**{name: np.array(value) for name, value in info.items()}, **masks}

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
