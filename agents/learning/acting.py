"""Who acts: trained policies, controllers and chance, and the table of what they score."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.files import CONFIG
from agents.learning.config import TrainConfig, load_config
from agents.learning.evaluation import Agent, HeldOutEvaluation
from clarke_gym.control import CONTROLLERS, make_controller


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
    # They load torch, which nobody else needs.
    from agents.learning.policies import PolicyAgent, load_policy

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
        worst = values.min() if metric.rises(values) else values.max()
        for name, value in (("median", middle), ("worst", worst)):
            rows.append((f"{metric.label}, {name}", f"{value:8.2f} {metric.shown_unit}".rstrip()))
    rows.append(("return, mean", f"{result['episode_return'].mean():8.2f}"))
    width = max(len(name) for name, _ in rows)
    lines = [f"{name:{width}}  {value}" for name, value in rows]
    return "\n".join([f"{folder}, agent {agent}, {n_goals} held-out goals", *lines])
