"""A run's environments and its untrained model."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.torch_layers import CombinedExtractor

from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import TrainConfig
from agents.learning.manifold_policy import ManifoldPolicy
from clarke_gym.integrations.sb3 import Sb3VecEnv, make_sb3_vec_env
from clarke_gym.numerics.arrays import FloatArray

SEEDS_PER_RUN = 100_000
"""Distance between the first environment seeds of two runs."""

TRAINING_SEED_LIMIT = 10_000 * SEEDS_PER_RUN
"""What every environment seed of a training stays below."""


def make_training_env(config: TrainConfig) -> Sb3VecEnv:
    """Return the training environments as an SB3 `VecEnv`, seeded for this run."""
    return make_sb3_vec_env(config.env.id, config.env.num_envs, **config.env.kwargs)


def onto_manifold(vec_env: Sb3VecEnv) -> FloatArray:
    """Return the map M, shape (2 segments, K), from actions to their Clarke coordinates.

    Raises
    ------
    ValueError
        If the representation of the actions is not linear.
    """
    env: Any = vec_env.env.unwrapped
    representation = env.action_representation
    if representation.polar:
        raise ValueError(f"actions in {representation.name!r} are no linear map of the manifold")
    onto: FloatArray = env.robot.encoder @ representation.decoder
    return onto


def make_model(config: TrainConfig, vec_env: Sb3VecEnv) -> BaseAlgorithm:
    """Return an untrained SB3 model for the run."""
    robot = vec_env.env.unwrapped.robot  # type: ignore[attr-defined]
    action_size = int(np.prod(vec_env.action_space.shape or (1,)))
    sizes = {"dof": 2 * robot.n_segments, "action": action_size, "num_envs": vec_env.num_envs}
    sizes["episode"] = vec_env.env.unwrapped.episode_steps  # type: ignore[attr-defined]
    arguments = config.algo.arguments(sizes)
    if "action_noise" in arguments:
        sigma = np.full(action_size, arguments["action_noise"])
        arguments["action_noise"] = NormalActionNoise(np.zeros(action_size), sigma)
    many = hasattr(vec_env.observation_space, "spaces")
    policy: Any = "MultiInputPolicy" if many else "MlpPolicy"
    if config.algo.manifold:
        policy = ManifoldPolicy
        settings = {"onto": onto_manifold(vec_env), **config.algo.manifold}
        arguments["policy_kwargs"] |= {"manifold": settings}
        if many:
            arguments["policy_kwargs"]["features_extractor_class"] = CombinedExtractor
    model_class: Any = ALGORITHMS[config.algo.name].load_class()
    model: BaseAlgorithm = model_class(policy, vec_env, seed=config.seed, device="cpu", **arguments)
    # SB3 has seeded the environments seed, seed + 1, ...: neighbouring runs would share episodes.
    vec_env.seed(config.seed * SEEDS_PER_RUN)
    return model
