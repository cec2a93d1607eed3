"""Evaluation on fixed held-out goals, apart from every training generator."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from agents.files import CONFIG
from agents.learning.config import EnvSettings, TrainConfig, load_config
from agents.learning.policies import load_policy
from agents.metrics import Metric
from clarke_gym.control import CONTROLLERS, make_controller

HELD_OUT_SEED = 2_000_000_000
"""First seed of the held-out episodes; training seeds stay below `TRAINING_SEED_LIMIT`."""

SEEDS_PER_RUN = 100_000
"""Distance between the first environment seeds of two runs."""

TRAINING_SEED_LIMIT = 10_000 * SEEDS_PER_RUN


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


class PolicyAgent:
    """A Stable-Baselines3 model that acts without exploration noise."""

    def __init__(self, model: Any) -> None:
        self._model = model

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return the deterministic actions."""
        actions: NDArray[np.float32] = self._model.predict(observation, deterministic=True)[0]
        return actions


class RandomAgent:
    """Uniformly random actions: the floor of every comparison."""

    def __init__(self, action_size: int, seed: int = 0) -> None:
        self._rng = np.random.default_rng(seed)
        self._size = action_size

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return uniform actions in [-1, 1]."""
        rows = len(observation["observation"] if isinstance(observation, dict) else observation)
        return self._rng.uniform(-1.0, 1.0, (rows, self._size)).astype(np.float32)


AGENTS = ("policy", "random", *CONTROLLERS)


def load_agent(folder: Path, config: TrainConfig, agent: str, env: Any) -> Agent:
    """Return an agent for a run's environments.

    Parameters
    ----------
    folder : Path
        Run folder; its ``policy/`` is read without executing anything.
    config : TrainConfig
        The run's configuration.
    agent : str
        One of `AGENTS`.
    env : gymnasium.vector.VectorEnv
        The environments to act in.

    Raises
    ------
    ValueError
        If `agent` is unknown.
    ConfigError
        If the policy is asked for and the run is not finished, or is damaged.
    """
    if agent not in AGENTS:
        raise ValueError(f"agent must be one of {list(AGENTS)}, got {agent!r}")
    if agent in CONTROLLERS:
        return make_controller(agent, env)
    if agent == "random":
        return RandomAgent(int(np.prod(env.single_action_space.shape)))
    return PolicyAgent(load_policy(folder, config))


def evaluate_run(folder: Path, agent: str, n_goals: int) -> str:
    """Return a table of held-out results of a finished run, or of a baseline on its environment.

    Parameters
    ----------
    folder : Path
        Run folder.
    agent : str
        One of `AGENTS`.
    n_goals : int
        Number of held-out goals.

    Raises
    ------
    ValueError
        If `agent` is unknown, or `n_goals` is not in 1 ... 10,000.
    ConfigError
        If the folder holds no run, or no finished one where the policy is asked for.
    """
    if not 1 <= n_goals <= 10_000:  # each is an environment
        raise ValueError(f"--goals must be in 1 ... 10000, got {n_goals}")
    config = load_config(TrainConfig, folder / CONFIG)
    evaluation = HeldOutEvaluation(config.env, n_goals)
    result = evaluation.run(load_agent(folder, config, agent, evaluation.env))
    evaluation.close()
    rows = [("success rate", f"{result['is_success'].mean():8.3f}")]
    for metric in evaluation.metrics:
        values = metric.factor * result[metric.name]
        middle = np.median(values)
        worst = values.max() if metric.factor * metric.worst >= middle else values.min()
        for name, value in (("median", middle), ("worst", worst)):
            rows.append((f"{metric.label}, {name}", f"{value:8.2f} {metric.shown_unit}".rstrip()))
    rows.append(("return, mean", f"{result['episode_return'].mean():8.2f}"))
    width = max(len(name) for name, _ in rows)
    lines = [f"{name:{width}}  {value}" for name, value in rows]
    return "\n".join([f"{folder}, agent {agent}, {n_goals} held-out goals", *lines])
