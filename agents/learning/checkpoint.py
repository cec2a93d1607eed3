"""Checkpoints that continue exactly: model, environments, and every random generator.

A checkpoint is a folder of plain data with a manifest of hashes that is written last; no reader
executes anything. Two are kept: a damaged one is said, and the one before it used.
"""

from __future__ import annotations

import json
import os
import random
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.save_util import recursive_getattr

from agents import files
from agents.learning import encoding
from clarke_gym.integrations.sb3 import Sb3VecEnv

FOLDER = "checkpoint"
"""The folder of checkpoints in a run folder."""

_NAME = re.compile(r"step_[0-9]{12}")
_FILES = (*encoding.FILES, files.MANIFEST)
_REMOVABLE = (*_FILES, "model.zip", "state.pkl", "replay_buffer.pkl")  # the last three: version 0.1

_COUNTERS = (
    "num_timesteps",
    "_total_timesteps",
    "_num_timesteps_at_start",
    "_current_progress_remaining",
    "_episode_num",
    "_n_updates",
    "_last_obs",
    "_last_original_obs",
    "_last_episode_starts",
    "ep_info_buffer",
    "ep_success_buffer",
)
"""What a model of Stable-Baselines3 carries from one rollout to the next, beside tensors and
replay; all else follows from the configuration. Its action noise has no state of its own."""


class DamagedError(Exception):
    """A checkpoint that is not as it was written; the message says how."""


class Checkpoints:
    """The checkpoints of one run.

    Parameters
    ----------
    run : Path
        The run folder, whose lock is held.
    """

    def __init__(self, run: Path) -> None:
        self._folder = run / FOLDER
        self._previous: Path | None = None
        files.refuse_links(run, [FOLDER])
        files.sweep(self._folder, _REMOVABLE)

    def save(self, model: BaseAlgorithm, vec_env: Sb3VecEnv, progress: dict[str, Any]) -> None:
        """Write a checkpoint, and remove all but the one before it.

        Parameters
        ----------
        model : BaseAlgorithm
            Between two rollouts.
        vec_env : Sb3VecEnv
            The training environments.
        progress : dict
            What the run has recorded so far.
        """
        target = self._folder / f"step_{model.num_timesteps:012d}"
        if target == self._previous:
            return
        contents = encoding.encode_state(_state(model, vec_env, progress))
        contents[files.MANIFEST] = _manifest(contents)
        with files.naming_full_disks(target):
            self._folder.mkdir(exist_ok=True)
            part = Path(tempfile.mkdtemp(dir=self._folder, prefix=files.PART))
            try:
                for name, data in contents.items():
                    with (part / name).open("wb") as file:
                        file.write(data)
                        file.flush()
                        os.fsync(file.fileno())
                files.fsync_folder(part)
                if target.exists() and not files.remove_own_folder(target, _REMOVABLE):
                    raise files.ConfigError(f"{target} holds files that are not this program's")
                part.rename(target)
            except BaseException:
                files.remove_own_folder(part, _REMOVABLE)
                raise
            files.fsync_folder(self._folder)
        for old in self._all():
            if old not in (target, self._previous):
                files.remove_own_folder(old, _REMOVABLE)
        self._previous = target

    def resume(
        self, make: Callable[[], tuple[BaseAlgorithm, Sb3VecEnv]]
    ) -> tuple[BaseAlgorithm, Sb3VecEnv, dict[str, Any]]:
        """Return model, environments and progress where the newest whole checkpoint was.

        Parameters
        ----------
        make : callable
            Returns an untrained model and its environments; called again after a checkpoint that
            turns out to be damaged when a part of it is in place.

        Returns
        -------
        model, vec_env, progress
            As made, and an empty dictionary, where there is nothing to continue from.
        """
        model, vec_env = make()
        for folder in reversed(self._all()):
            try:
                progress = _restore(_read(folder), model, vec_env)
            except DamagedError as error:
                print(f"{folder} is damaged ({error}): not used", file=sys.stderr, flush=True)
                vec_env.close()
                model, vec_env = make()
                continue
            self._previous = folder
            return model, vec_env, progress
        return model, vec_env, {}

    def _all(self) -> list[Path]:
        if not self._folder.is_dir():
            return []
        return sorted(
            path
            for path in self._folder.iterdir()
            if _NAME.fullmatch(path.name) and path.is_dir() and not path.is_symlink()
        )


def _manifest(contents: dict[str, bytes]) -> bytes:
    """Return the only manifest that fits the files, so that damage to itself shows as well."""
    hashes = {name: files.sha256(contents[name]) for name in encoding.FILES}
    return (json.dumps({"format": 1, "sha256": hashes}, indent=2) + "\n").encode()


def _read(folder: Path) -> dict[str, Any]:
    try:
        contents = {name: (folder / name).read_bytes() for name in _FILES}
    except OSError as error:
        old = (folder / "state.pkl").exists()
        raise DamagedError(
            "it was written by version 0.1 with pickle, which could run any code" if old else error
        ) from error
    if contents[files.MANIFEST] != _manifest(contents):
        raise DamagedError("its files are not as its manifest says")
    try:
        state: dict[str, Any] = encoding.decode_state(contents)
    except Exception as error:  # whole, but nothing that this program has written
        raise DamagedError(f"{type(error).__name__}: {error}") from error
    return state


def _state(model: BaseAlgorithm, vec_env: Sb3VecEnv, progress: dict[str, Any]) -> dict[str, Any]:
    _, variables = model._get_torch_save_params()
    return {
        "parameters": model.get_parameters(),
        "variables": {name: recursive_getattr(model, name) for name in variables},
        "counters": {name: getattr(model, name) for name in _COUNTERS},
        "replay": _replay(model) if isinstance(model, OffPolicyAlgorithm) else None,
        "env": vec_env.env.unwrapped.state(),  # type: ignore[attr-defined]
        "random": random.getstate(),
        "numpy": np.random.get_state(),  # noqa: NPY002  (SB3 draws from the global generator)
        "torch": torch.get_rng_state(),
        "actions": model.action_space.np_random,  # off-policy learners draw their first ones here
        "progress": progress,
    }


def _restore(state: dict[str, Any], model: BaseAlgorithm, vec_env: Sb3VecEnv) -> dict[str, Any]:
    try:
        model.set_parameters(state["parameters"], exact_match=True, device="cpu")
        for name, value in state["variables"].items():
            recursive_getattr(model, name).data.copy_(value)
        for name in _COUNTERS:
            setattr(model, name, state["counters"][name])
        if isinstance(model, OffPolicyAlgorithm):
            _refill(model, state["replay"])
        vec_env.env.unwrapped.restore(state["env"])  # type: ignore[attr-defined]
        random.setstate(state["random"])
        np.random.set_state(state["numpy"])  # noqa: NPY002
        torch.set_rng_state(state["torch"])
        if "actions" in state:  # checkpoints of earlier versions lack it
            model.action_space._np_random = state["actions"]
        progress: dict[str, Any] = state["progress"]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RuntimeError) as error:
        raise DamagedError(f"it is of another model: {type(error).__name__}: {error}") from error
    return progress


def _buffer_arrays(model: OffPolicyAlgorithm) -> dict[str, Any]:
    """Return the replay buffer's arrays; a row of each is one step of all environments."""
    arrays: dict[str, Any] = {}
    for name, value in vars(model.replay_buffer).items():
        parts = value if isinstance(value, dict) else {"": value}
        for key, part in parts.items():
            if isinstance(part, np.ndarray) and part.dtype != object:  # `infos` are never kept
                arrays[f"{name}.{key}"] = part
    return arrays


def _replay(model: OffPolicyAlgorithm) -> dict[str, Any]:
    buffer = model.replay_buffer
    assert buffer is not None
    rows = buffer.buffer_size if buffer.full else buffer.pos
    arrays = {
        name: array[:rows] if array.shape[:2] == (buffer.buffer_size, buffer.n_envs) else array
        for name, array in _buffer_arrays(model).items()
    }
    return {"pos": buffer.pos, "full": buffer.full, "arrays": arrays}


def _refill(model: OffPolicyAlgorithm, replay: dict[str, Any]) -> None:
    buffer = model.replay_buffer
    assert buffer is not None
    arrays = _buffer_arrays(model)
    if arrays.keys() != replay["arrays"].keys():
        raise ValueError("the replay buffer has other arrays")
    for name, array in arrays.items():
        kept = replay["arrays"][name]
        if kept.dtype != array.dtype or kept.shape[1:] != array.shape[1:]:
            raise ValueError(f"the replay buffer's {name} has another shape")
        array[: len(kept)] = kept
    buffer.pos, buffer.full = replay["pos"], replay["full"]
