"""One training run: environment, algorithm, held-out evaluation, run folder."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.noise import NormalActionNoise

from agents import files
from agents.files import DONE, FAILED
from agents.learning import checkpoint
from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import TrainConfig
from agents.learning.evaluation import SEEDS_PER_RUN, HeldOutEvaluation, PolicyAgent
from agents.metrics import FILE as METRICS_FILE
from agents.metrics import metrics_text
from agents.plugins import import_plugins
from clarke_gym.integrations.sb3 import Sb3VecEnv, make_sb3_vec_env

ProgressHook = Callable[[int], object]
"""Called with the number of environment steps done since the last call."""


class _Recorder(BaseCallback):
    """Evaluates and checkpoints between rollouts, on a fixed grid of environment steps."""

    def __init__(
        self,
        config: TrainConfig,
        folder: Path,
        vec_env: Sb3VecEnv,
        progress: dict[str, Any],
        hook: ProgressHook,
    ) -> None:
        super().__init__()
        self._config, self._folder, self._vec_env, self._hook = config, folder, vec_env, hook
        self._evaluation = HeldOutEvaluation(config.env, config.evaluation.n_goals)
        self._steps: list[int] = progress.get("steps", [])
        self._evals: list[dict[str, Any]] = progress.get("evals", [])
        self._rows: list[dict[str, float]] = progress.get("rows", [])
        self._wall_0 = time.perf_counter() - progress.get("wall_s", 0.0)
        self._cpu_0 = time.process_time() - progress.get("cpu_s", 0.0)
        self._reported = self._steps[-1] if self._steps else 0

    @property
    def wall_s(self) -> float:
        """Seconds spent, interrupted sessions included."""
        return time.perf_counter() - self._wall_0

    @property
    def cpu_s(self) -> float:
        """CPU seconds spent, interrupted sessions included."""
        return time.process_time() - self._cpu_0

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        self._hook(self.num_timesteps - self._reported)
        self._reported = self.num_timesteps
        if self.num_timesteps % self._config.evaluation.every_steps == 0:
            self.evaluate()
        if self.num_timesteps and self.num_timesteps % self._config.checkpoint_every_steps == 0:
            progress = {
                "steps": self._steps,
                "evals": self._evals,
                "rows": self._rows,
                "wall_s": self.wall_s,
                "cpu_s": self.cpu_s,
            }
            checkpoint.save(self._folder / "checkpoint", self.model, self._vec_env, progress)

    def evaluate(self) -> None:
        """Evaluate once at this number of steps."""
        if self.num_timesteps in self._steps:
            return
        result = self._evaluation.run(PolicyAgent(self.model))
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
        """Write evals.npz, what its metrics are, and progress.csv."""
        files.write_text(self._folder / METRICS_FILE, metrics_text(self._evaluation.metrics))
        arrays = {name: np.stack([e[name] for e in self._evals]) for name in self._evals[0]}
        files.write_npz(
            self._folder / "evals.npz", {"env_steps": np.array(self._steps, np.int64), **arrays}
        )
        text = io.StringIO()
        writer = csv.DictWriter(text, fieldnames=list(self._rows[-1]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(self._rows)
        files.write_text(self._folder / "progress.csv", text.getvalue())

    def finish(self) -> None:
        """Report the last steps and close the evaluation."""
        self._hook(self.num_timesteps - self._reported)
        self._evaluation.close()


def make_training_env(config: TrainConfig) -> Sb3VecEnv:
    """Return the training environments as an SB3 `VecEnv`, seeded for this run."""
    return make_sb3_vec_env(config.env.id, config.env.num_envs, **config.env.kwargs)


def make_model(config: TrainConfig, vec_env: Sb3VecEnv) -> BaseAlgorithm:
    """Return an untrained SB3 model for the run."""
    robot = vec_env.env.unwrapped.robot  # type: ignore[attr-defined]
    action_size = int(np.prod(vec_env.action_space.shape or (1,)))
    arguments = config.algo.arguments({"dof": 2 * robot.n_segments, "action": action_size})
    if "action_noise" in arguments:
        sigma = np.full(action_size, arguments["action_noise"])
        arguments["action_noise"] = NormalActionNoise(np.zeros(action_size), sigma)
    policy = "MultiInputPolicy" if hasattr(vec_env.observation_space, "spaces") else "MlpPolicy"
    model_class: Any = ALGORITHMS[config.algo.name].load_class()
    model: BaseAlgorithm = model_class(policy, vec_env, seed=config.seed, device="cpu", **arguments)
    # SB3 has seeded the environments seed, seed + 1, ...: neighbouring runs would share episodes.
    vec_env.seed(config.seed * SEEDS_PER_RUN)
    return model


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
        If the folder holds a run of another configuration, or a plug-in cannot be imported.
    RuntimeError
        If another process is writing into the folder.
    """
    hook = hook or (lambda steps: None)  # noqa: ARG005
    plugins = import_plugins(config.plugins)
    with files.locked(folder):
        files.keep_or_write_yaml(folder / "config.yaml", config.model_dump(mode="json"))
        if (folder / DONE).exists():
            hook(config.total_steps)
            return False
        torch.set_num_threads(threads)
        vec_env = make_training_env(config)
        model_class = ALGORITHMS[config.algo.name].load_class()
        resumed = checkpoint.load(folder / "checkpoint", model_class, vec_env)
        model, progress = resumed or (make_model(config, vec_env), {})
        if resumed:
            hook(model.num_timesteps)
        model.set_logger(configure(str(folder / "tensorboard"), ["tensorboard"]))
        recorder = _Recorder(config, folder, vec_env, progress, hook)
        model.learn(
            config.total_steps - model.num_timesteps,
            callback=recorder,
            reset_num_timesteps=False,
            log_interval=10,
        )
        recorder.evaluate()
        recorder.finish()
        recorder.write_results()
        model.save(folder / ".model.part.zip")
        (folder / ".model.part.zip").replace(folder / "model.zip")
        files.write_manifest(
            folder / "manifest.json",
            {
                "seed": config.seed,
                "plugins": plugins,
                "threads": threads,
                "wall_s": round(recorder.wall_s, 3),
                "cpu_s": round(recorder.cpu_s, 3),
            },
        )
        (folder / FAILED).unlink(missing_ok=True)
        files.write_text(folder / DONE, "")
        vec_env.close()
        model.logger.close()
    return True
