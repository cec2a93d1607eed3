"""Finished policies: tensors in safetensors, and what they are in JSON. Reading executes nothing.

The network is built from the run's validated configuration; the file only fills it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.torch
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.torch_layers import FlattenExtractor

from agents import files
from agents.files import ConfigError
from agents.learning.config import TrainConfig
from agents.learning.manifold_policy import ManifoldPolicy, output_gain
from agents.learning.models import make_model, make_training_env

FOLDER = "policy"
TENSORS, ABOUT = f"{FOLDER}/policy.safetensors", f"{FOLDER}/policy.json"


def _shape(space: spaces.Space[Any]) -> Any:
    if isinstance(space, spaces.Dict):
        return {name: _shape(part) for name, part in space.spaces.items()}
    return {"shape": list(space.shape or ()), "dtype": str(space.dtype)}


def write_policy(folder: Path, config: TrainConfig, model: BaseAlgorithm) -> None:
    """Write a model's policy into ``policy/`` of a run folder."""
    (folder / FOLDER).mkdir(exist_ok=True)
    policy: Any = model.policy
    about = {
        "format": 1,
        "algorithm": config.algo.name,
        "policy_class": type(policy).__name__,
        "settings": config.algo.model_dump(mode="json"),
        "output_gain": output_gain(policy),
        "env": config.env.model_dump(mode="json"),
        "observation_space": _shape(model.observation_space),
        "action_space": _shape(model.action_space),
        "env_steps": model.num_timesteps,
        "seed": config.seed,
    }
    tensors = {name: t.detach().clone() for name, t in policy.state_dict().items()}
    files.write_bytes(folder / TENSORS, safetensors.torch.save(tensors))
    files.write_text(folder / ABOUT, json.dumps(about, indent=2) + "\n")


def load_policy(folder: Path, config: TrainConfig) -> BaseAlgorithm:
    """Return a model whose policy is that of a finished run.

    Raises
    ------
    ConfigError
        If there is none, it is damaged, or it is not of this configuration.
    """
    if not (folder / TENSORS).is_file():
        if (folder / "model.zip").exists():
            raise ConfigError(
                f"{folder} holds a model.zip of version 0.1: a pickle, which could run any code, "
                "and is not read. Train the run again, into another folder"
            )
        raise ConfigError(f"{folder} holds no trained policy ({TENSORS}); finish it first")
    if not (folder / files.DONE).is_file():
        raise ConfigError(f"{folder} is not finished; the command that trained it goes on with it")
    if found := files.damage(folder):
        raise ConfigError(f"damaged run: {found}")
    vec_env = make_training_env(config)
    model = make_model(config, vec_env)
    vec_env.close()
    try:
        model.policy.load_state_dict(safetensors.torch.load((folder / TENSORS).read_bytes()))
    except (RuntimeError, ValueError, safetensors.SafetensorError) as error:
        reason = str(error).splitlines()[0]
        raise ConfigError(f"{folder / TENSORS} does not fit {files.CONFIG}: {reason}") from None
    return model


class PolicyAgent:
    """A Stable-Baselines3 model that acts without exploration noise."""

    def __init__(self, model: BaseAlgorithm) -> None:
        self._model = model
        policy: Any = model.policy
        # An actor and critic of plain vectors: no memory, no parts.
        self._plain = type(policy) in (ActorCriticPolicy, ManifoldPolicy) and isinstance(
            policy.features_extractor, FlattenExtractor
        )

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return the deterministic actions: those of the model's `predict`, bit for bit."""
        if not self._plain:
            actions: NDArray[np.float32] = self._model.predict(observation, deterministic=True)[0]
            return actions
        # `predict` makes a distribution of the mean first, which takes three times as long.
        policy: Any = self._model.policy
        with torch.inference_mode():
            hidden = policy.mlp_extractor.policy_net(torch.as_tensor(observation))
            means = output_gain(policy) * policy.action_net(hidden)
        return np.clip(means.numpy(), -1.0, 1.0)
