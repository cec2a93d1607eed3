"""One training run: environment, algorithm, held-out evaluation, run folder."""

from __future__ import annotations

import csv
import io
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from agents import files, yaml_files
from agents.files import CONFIG, DONE, EVALS, FAILED, GOALS, MANIFEST, ConfigError
from agents.learning import checkpoint, diagnostics, policies
from agents.learning.config import TrainConfig
from agents.learning.evaluation import HeldOutEvaluation
from agents.learning.models import make_model, make_training_env, onto_manifold
from agents.learning.noise_course import NoiseCourse
from agents.metrics import FILE as METRICS_FILE
from agents.metrics import metrics_text
from agents.plugins import import_plugins
from clarke_gym.integrations.sb3 import Sb3VecEnv

ProgressHook = Callable[[int], object]
"""Called with the number of environment steps done since the last call."""

PROGRESS, LOGS = "progress.csv", "tensorboard"
RESULTS = (
    CONFIG,
    METRICS_FILE,
    EVALS,
    PROGRESS,
    diagnostics.FILE,
    policies.TENSORS,
    policies.ABOUT,
)
"""What a finished run is, hashed in its manifest."""


class LearningFailure(RuntimeError):
    """The policy is no longer finite, or its noise has collapsed: no fault of the machine."""


class Recorder(BaseCallback):
    """Evaluates, diagnoses and checkpoints between rollouts, on a fixed grid of steps."""

    def __init__(
        self,
        config: TrainConfig,
        folder: Path,
        vec_env: Sb3VecEnv,
        checkpoints: checkpoint.Checkpoints,
        progress: dict[str, Any],
        hook: ProgressHook,
    ) -> None:
        super().__init__()
        self._checkpoints = checkpoints
        self._config, self._folder, self._vec_env, self._hook = config, folder, vec_env, hook
        self._evaluation = HeldOutEvaluation(config.env, config.evaluation.n_goals)
        self._steps: list[int] = progress.get("steps", [])
        self._evals: list[dict[str, Any]] = progress.get("evals", [])
        self._rows: list[dict[str, float]] = progress.get("rows", [])
        self._wall_0 = time.perf_counter() - progress.get("wall_s", 0.0)
        self._cpu_0 = time.process_time() - progress.get("cpu_s", 0.0)
        self._inside: diagnostics.Rows = progress.get("diagnostics", {})
        self._reported = self._steps[-1] if self._steps else 0

    def _init_callback(self) -> None:
        self._diagnostics = diagnostics.Diagnostics(self.model, self._vec_env, self._inside)
        self._each_update = isinstance(self.model, OnPolicyAlgorithm)

    @property
    def wall_s(self) -> float:
        """Seconds spent, interrupted sessions included."""
        return time.perf_counter() - self._wall_0

    @property
    def cpu_s(self) -> float:
        """CPU seconds spent, interrupted sessions included."""
        return time.process_time() - self._cpu_0

    def _on_step(self) -> bool:
        self._diagnostics.after_step()
        return True

    def _on_rollout_start(self) -> None:
        self._hook(self.num_timesteps - self._reported)
        self._reported = self.num_timesteps
        self.diagnose()
        if self.num_timesteps % self._config.evaluation.every_steps == 0:
            self.evaluate()
        if self.num_timesteps and self.num_timesteps % self._config.checkpoint_every_steps == 0:
            self.save()

    def _on_rollout_end(self) -> None:
        self._diagnostics.after_rollout()

    def diagnose(self) -> None:
        """Record the last update; algorithms that update at every step do so at evaluations."""
        if self._each_update or self.num_timesteps % self._config.evaluation.every_steps == 0:
            self._diagnostics.after_update()

    def save(self) -> None:
        """Write a checkpoint."""
        progress = {
            "steps": self._steps,
            "evals": self._evals,
            "rows": self._rows,
            "diagnostics": self._inside,
            "wall_s": self.wall_s,
            "cpu_s": self.cpu_s,
        }
        self._checkpoints.save(self.model, self._vec_env, progress)

    def evaluate(self) -> None:
        """Evaluate once at this number of steps.

        Raises
        ------
        LearningFailure
            If the policy is no longer finite.
        """
        if self.num_timesteps in self._steps:
            return
        if not is_finite(self.model):
            raise LearningFailure(f"the policy is not finite after {self.num_timesteps} steps")
        result = self._evaluation.run(policies.PolicyAgent(self.model))
        self._steps.append(self.num_timesteps)
        self._evals.append(result)
        scores = {
            "success_rate": float(result["is_success"].mean()),
            **{m.name: float(np.median(result[m.name])) for m in self._evaluation.metrics},
            "episode_return": float(result["episode_return"].mean()),
        }
        spent = {"wall_s": round(self.wall_s, 3), "cpu_s": round(self.cpu_s, 3)}
        self._rows.append({"env_steps": self.num_timesteps, **spent, **scores})
        for name, score in scores.items():
            self.logger.record(f"held_out/{name}", score)
        self.logger.dump(self.num_timesteps)

    def write_results(self) -> None:
        """Write evals.npz, what its metrics are, diagnostics.npz and progress.csv."""
        files.write_text(self._folder / METRICS_FILE, metrics_text(self._evaluation.metrics))
        arrays = {name: np.stack([e[name] for e in self._evals]) for name in self._evals[0]}
        arrays = {"env_steps": np.array(self._steps, np.int64), **arrays}
        goals = self._evaluation.goal_positions()
        arrays |= {} if goals is None else {GOALS: goals}
        files.write_bytes(self._folder / EVALS, files.npz_bytes(arrays))
        inside = self._diagnostics.arrays()
        files.write_bytes(self._folder / diagnostics.FILE, files.npz_bytes(inside))
        text = io.StringIO()
        writer = csv.DictWriter(text, fieldnames=list(self._rows[-1]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(self._rows)
        files.write_text(self._folder / PROGRESS, text.getvalue())

    def finish(self) -> None:
        """Report the last steps and close the evaluation."""
        self._hook(self.num_timesteps - self._reported)
        self._evaluation.close()


def is_finite(model: BaseAlgorithm) -> bool:
    """Return whether every number of the policy is finite."""
    return all(bool(torch.isfinite(tensor).all()) for tensor in model.policy.state_dict().values())


def _claim(config: TrainConfig, folder: Path) -> None:
    """Make the folder that of this run, or of a longer one that continues it.

    A finished run whose configuration differs in a larger `total_steps` alone is extended: its
    result is kept in ``until_<steps>``, and training goes on from its last checkpoint.
    """
    files.refuse_links(folder, (*RESULTS, MANIFEST, DONE, FAILED, LOGS, policies.FOLDER))
    own = (part for name in (*RESULTS, MANIFEST, DONE) for part in Path(name).parts)
    files.sweep(folder, own)
    files.sweep(folder / policies.FOLDER)
    path, wanted = folder / CONFIG, config.model_dump(mode="json")
    if path.exists():
        found = yaml_files.read_yaml(path)
        steps = found.get("total_steps")
        longer = yaml_files.differences(found, wanted) == ["total_steps"] and (
            isinstance(steps, int) and steps < config.total_steps
        )
        kept = folder / f"until_{steps:012d}" if longer else folder
        if longer and ((folder / DONE).exists() or (kept / DONE).exists()):
            if config.algo.ends_slowly:
                raise ConfigError(
                    f"{folder} ended with a small algo.final_learning_rate, from which "
                    "a longer run does not continue; train one in a folder of its own"
                )
            if (folder.parent.parent / "study.yaml").exists():
                raise ConfigError(
                    f"{folder} belongs to a study, whose runs are of equal length; copy the folder "
                    "elsewhere and extend it there"
                )
            if not (kept / DONE).exists():
                _keep_result(folder, kept)
            (folder / DONE).unlink(missing_ok=True)
            files.write_text(path, yaml_files.yaml_text(wanted))
            return
    yaml_files.keep_or_write_yaml(path, wanted)


def _keep_result(folder: Path, kept: Path) -> None:
    """Copy a finished result; it is there as a whole or not at all."""
    if found := files.damage(folder):
        raise ConfigError(f"damaged run: {found}")
    part = Path(tempfile.mkdtemp(dir=folder, prefix=files.PART))
    (part / policies.FOLDER).mkdir()
    for name in (*RESULTS, MANIFEST, DONE):
        if (folder / name).exists():  # older runs have no diagnostics
            files.write_bytes(part / name, (folder / name).read_bytes())
    part.chmod(0o755)
    part.rename(kept)
    files.fsync_folder(folder)


def train(
    config: TrainConfig, folder: Path, hook: ProgressHook | None = None, threads: int = 1
) -> bool:
    """Train one run in `folder`, continuing from its last checkpoint.

    Parameters
    ----------
    config : TrainConfig
    folder : Path
        Run folder; created if missing.
    hook : callable, optional
        Called with the environment steps done since the last call.
    threads : int
        Torch threads; one keeps equal seeds equal bit for bit.

    Returns
    -------
    bool
        False if the run was finished before and nothing was done.

    Raises
    ------
    ConfigError
        If the folder is no run's or holds a run of another configuration, or a plug-in cannot be
        imported.
    RuntimeError
        If another process is writing into the folder.
    LearningFailure
        If the policy is no longer finite; FAILED says so. Every other error leaves the run
        unfinished, to be continued from its last checkpoint.
    """
    hook = hook or (lambda steps: None)  # noqa: ARG005
    plugins = import_plugins(config.plugins)
    files.refuse_foreign(folder, CONFIG)
    with files.locked(folder):
        _claim(config, folder)
        if (folder / DONE).exists():
            hook(config.total_steps)
            return False
        torch.set_num_threads(threads)
        checkpoints = checkpoint.Checkpoints(folder)
        model, vec_env, progress = checkpoints.resume(lambda: _make(config))
        if model.num_timesteps:
            hook(model.num_timesteps)
        model.set_logger(configure(str(folder / LOGS), ["tensorboard"]))
        recorder = Recorder(config, folder, vec_env, checkpoints, progress, hook)
        try:
            _learn(config, model, vec_env, recorder)
        except LearningFailure:
            files.write_text(folder / FAILED, traceback.format_exc())
            raise
        finally:
            recorder.finish()
            vec_env.close()
            model.logger.close()
        recorder.write_results()
        policies.write_policy(folder, config, model)
        spent = {"wall_s": round(recorder.wall_s, 3), "cpu_s": round(recorder.cpu_s, 3)}
        origin = {"seed": config.seed, "plugins": plugins, "threads": threads, **spent}
        files.finish(folder, RESULTS, origin)
    return True


def _make(config: TrainConfig) -> tuple[BaseAlgorithm, Sb3VecEnv]:
    vec_env = make_training_env(config)
    return make_model(config, vec_env), vec_env


def _learn(
    config: TrainConfig, model: BaseAlgorithm, vec_env: Sb3VecEnv, recorder: Recorder
) -> None:
    """Train to the end and leave a checkpoint there, from which a longer run can go on."""
    recorder.init_callback(model)
    callbacks: list[BaseCallback] = [recorder]
    if config.algo.course:
        callbacks.append(NoiseCourse(config.algo.course, onto_manifold(vec_env)))
    try:
        if model.num_timesteps < config.total_steps:
            model.learn(
                config.total_steps - model.num_timesteps,
                callback=callbacks,
                reset_num_timesteps=False,
                log_interval=10,
            )
        recorder.num_timesteps = model.num_timesteps
        recorder.diagnose()
        recorder.evaluate()
        recorder.save()
    except torch.linalg.LinAlgError as error:  # type: ignore[attr-defined]
        reason = str(error).splitlines()[0]
        raise LearningFailure(f"the policy's noise is singular: {reason}") from error
    except ValueError as error:  # torch and the environment refuse what is not finite
        if is_finite(model) and "to satisfy the constraint" not in str(error):
            raise
        reason = str(error).splitlines()[0]
        raise LearningFailure(f"the policy is not finite: {reason}") from error
