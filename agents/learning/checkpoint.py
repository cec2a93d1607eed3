"""Checkpoints that continue exactly: model, environments, and every random generator."""

from __future__ import annotations

import os
import pickle
import random
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from clarke_gym.integrations.sb3 import Sb3VecEnv


def save(folder: Path, model: BaseAlgorithm, vec_env: Sb3VecEnv, progress: dict[str, Any]) -> None:
    """Write a checkpoint into `folder` and remove older ones.

    Parameters
    ----------
    folder : Path
        The run's ``checkpoint`` folder.
    model : BaseAlgorithm
        Between two rollouts.
    vec_env : Sb3VecEnv
        The training environments.
    progress : dict
        What the run has recorded so far.
    """
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"step_{model.num_timesteps:012d}"
    if target.exists():
        return
    part = Path(tempfile.mkdtemp(dir=folder, prefix=".part-"))
    model.save(part / "model.zip")
    if isinstance(model, OffPolicyAlgorithm):
        model.save_replay_buffer(part / "replay_buffer.pkl")
    state = {
        "env": vec_env.env.unwrapped.state(),  # type: ignore[attr-defined]
        "random": random.getstate(),
        "numpy": np.random.get_state(),  # noqa: NPY002  (SB3 draws from the global generator)
        "torch": torch.get_rng_state(),
        "progress": progress,
    }
    (part / "state.pkl").write_bytes(pickle.dumps(state))
    os.replace(part, target)  # noqa: PTH105
    for old in folder.iterdir():
        if old != target:
            shutil.rmtree(old)


def load(
    folder: Path, model_class: type[BaseAlgorithm], vec_env: Sb3VecEnv
) -> tuple[BaseAlgorithm, dict[str, Any]] | None:
    """Return the model and progress of the newest checkpoint, or None if there is none.

    Environments and random generators are put back where they were. A checkpoint is a pickle:
    load only your own.
    """
    steps = sorted(folder.glob("step_*")) if folder.is_dir() else []
    if not steps:
        return None
    newest = steps[-1]
    model = model_class.load(newest / "model.zip", env=vec_env, device="cpu", force_reset=False)
    if isinstance(model, OffPolicyAlgorithm):
        model.load_replay_buffer(newest / "replay_buffer.pkl")
    state = pickle.loads((newest / "state.pkl").read_bytes())
    vec_env.env.unwrapped.restore(state["env"])  # type: ignore[attr-defined]
    random.setstate(state["random"])
    np.random.set_state(state["numpy"])  # noqa: NPY002
    torch.set_rng_state(state["torch"])
    return model, state["progress"]
