"""The scalar environment: a batch of one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from clarke_gym._arrays import components
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore, Observation

_ROW = np.array([0])

RENDER_MODES = ("rgb_array", "depth_array")


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
        self._action_shape = (self.core.robot.n_joints,)
        self._goal_env = config.goal_env
        entries = self.core.observation_spaces()
        self.action_space = self.core.action_space()  # type: ignore[assignment]
        self.observation_space = (
            spaces.Dict(entries) if config.goal_env else entries["observation"]  # type: ignore[arg-type]
        )

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
        return self._observation(self.core.observe()), info

    def step(self, action: ArrayLike) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one control period under a joint-space action.

        Parameters
        ----------
        action : array_like, shape (N,)
            One number a tendon; 1 is the speed limit or, in absolute control, the largest
            displacement. Larger numbers saturate.

        Returns
        -------
        observation, reward, terminated, truncated, info

        Raises
        ------
        ValueError
            If the action has another shape or is not finite.
        """
        joint = np.asarray(action, dtype=np.float64)
        if joint.shape != self._action_shape:
            raise ValueError(f"action must have the shape {self._action_shape}, got {joint.shape}")
        self.core.step(joint.tolist())
        reward, info = self.core.reward()
        return self._observation(self.core.observe()), reward, info["diverged"], False, info

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

    def _observation(self, batch: Observation) -> Any:
        return batch if self._goal_env else batch["observation"]


class ContinuumRobotGoalEnv(ContinuumRobotEnv):
    """The same robot with dictionary observations and a reward that can be asked of any goals."""

    def compute_reward(self, achieved_goal: Any, desired_goal: Any, info: Any) -> Any:
        """Return the reward of goals as observed; any leading shape (for hindsight replay)."""
        del info  # the reward depends on the goals alone
        return goal_reward(self.core, achieved_goal, desired_goal)


def goal_reward(core: EnvCore, achieved: ArrayLike, desired: ArrayLike) -> Any:
    """Return the task's reward of goals as observed, shape (..., goal_size)."""
    goals = [np.asarray(goal, dtype=np.float32) for goal in (achieved, desired)]
    lead = np.broadcast_shapes(*(goal.shape[:-1] for goal in goals))
    rows = [np.broadcast_to(goal, (*lead, goal.shape[-1])) for goal in goals]
    parts = [components(array.reshape(-1, array.shape[-1]), scalar=not lead) for array in rows]
    reward = core.task.reward(*parts)[0]
    return reward.reshape(lead) if lead else reward


def render_rows(core: EnvCore, mode: str | None, rows: Iterable[int]) -> tuple[Any, ...]:
    """Return pictures or depths of the environments `rows`; nothing without a render mode."""
    if mode is None:
        return ()
    size = (core.config.render_width, core.config.render_height)
    return tuple(pair[RENDER_MODES.index(mode)] for pair in core.pictures(size, rows))


def check_render_mode(render_mode: str | None, allowed: list[str]) -> None:
    """Refuse a render mode that the environment does not have."""
    if render_mode is not None and render_mode not in allowed:
        raise ValueError(f"render_mode must be None or one of {allowed}, got {render_mode!r}")


def check_options(options: dict[str, Any] | None, goal_size: int, rows: int) -> Any:
    """Return the goals given in reset options, shape (rows, goal_size), or None."""
    if not options:
        return None
    unknown = sorted(set(options) - {"goal"})
    if unknown:
        raise ValueError(f"reset options may hold 'goal' only, got {unknown}")
    goal = np.asarray(options["goal"], dtype=np.float64)
    if goal.shape not in ((goal_size,), (rows, goal_size)) or not np.isfinite(goal).all():
        raise ValueError(
            f"options['goal'] must be finite with the shape ({goal_size},) or "
            f"({rows}, {goal_size}), got {options['goal']!r}"
        )
    return np.broadcast_to(goal, (rows, goal_size))
