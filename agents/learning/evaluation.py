"""Evaluation on fixed held-out goals, apart from every training generator."""

from __future__ import annotations

from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.learning.config import EnvSettings
from agents.metrics import Metric

HELD_OUT_SEED = 2_000_000_000
"""First seed of the held-out episodes; training seeds stay below `models.TRAINING_SEED_LIMIT`."""


class Agent(Protocol):
    """Anything that acts: a trained policy or a controller."""

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions (B, k) for a batch of observations."""


class HeldOutEvaluation:
    """The same start states and goals at every call, whatever the training did before.

    Parameters
    ----------
    settings : EnvSettings
        The training environment; the evaluation uses one environment a goal.
    n_goals : int
    """

    def __init__(self, settings: EnvSettings, n_goals: int) -> None:
        self.env = gym.make_vec(
            settings.id,
            num_envs=n_goals,
            autoreset_mode="disabled",
            **settings.kwargs,  # type: ignore[arg-type]
        )
        declared = self.env.unwrapped.task.metrics  # type: ignore[attr-defined]
        self.metrics = tuple(Metric(m.name, m.label, m.unit, m.worst) for m in declared)
        """What the task measures, the leading metric first."""

    def run(self, agent: Agent) -> dict[str, NDArray[Any]]:
        """Return results of one deterministic episode a goal.

        Returns
        -------
        dict of ndarray, shape (n_goals,)
            ``is_success`` and the task's `metrics`, by name, at the end of the episode, and
            ``episode_return``. A diverged episode is no success, and its metrics are the worst
            that the task declares.
        """
        observation, info = self.env.reset(seed=HELD_OUT_SEED)
        total = np.zeros(self.env.num_envs)
        failed = np.zeros(self.env.num_envs, dtype=bool)
        ended = failed.copy()
        while not ended.all():
            observation, reward, terminated, truncated, info = self.env.step(agent.act(observation))
            failed |= terminated
            total += np.where(failed, 0.0, reward)
            ended = truncated | failed
            if terminated.any() and not ended.all():  # keep the batch stepping to the time limit
                observation, _ = self.env.reset(options={"reset_mask": terminated})
        return {
            "is_success": info["is_success"] & ~failed,
            **{
                metric.name: np.where(failed, metric.worst, info[metric.name])
                for metric in self.metrics
            },
            "episode_return": total,
        }

    def goal_positions(self) -> NDArray[np.float64] | None:
        """Return where the held-out goals are [m], shape (n_goals, 3).

        Returns
        -------
        ndarray or None
            The last position where a goal has several, as a shape has its tip; None where goals
            are no places, or move.
        """
        env: Any = self.env.unwrapped
        goal = env.task.goal
        if goal is None or env.task.goal_moves or not len(goal.positions):
            return None
        self.env.reset(seed=HELD_OUT_SEED)
        positions: NDArray[np.float64] = env.goal[:, goal.positions[-1]]
        return positions

    def close(self) -> None:
        """Close the environment."""
        self.env.close()
