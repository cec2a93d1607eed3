"""What the engine costs over Stable-Baselines3 alone.

python -m benchmarks.engine_cost [--rounds 5]

Whole runs as they are shipped, two of quick.yaml and reach_clarke.yaml, in CPU time of the process.
Each is told in two ways. *Within*: `train` over the time that SB3's `learn` takes inside that same
run, without what the engine does in its callbacks; a machine whose speed drifts changes both alike.
*Beside*: `train` over `learn` alone with the same model and environment, run in turn, the ratio of
every pair; it scatters with the machine. docs/results/measured/engine_cost.json keeps all that.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import torch
from stable_baselines3 import PPO

from agents.files import ROOT
from agents.learning import training
from agents.learning.checkpoint import Checkpoints
from agents.learning.config import TrainConfig, load_config
from agents.learning.diagnostics import Diagnostics
from agents.learning.evaluation import HeldOutEvaluation
from agents.learning.models import make_model, make_training_env
from agents.studies.config import StudyConfig
from benchmarks.measured import keep

PARTS = (
    (PPO, "learn", "learn"),
    (training.Recorder, "_on_step", "callbacks"),
    (training.Recorder, "_on_rollout_start", "callbacks"),
    (training.Recorder, "_on_rollout_end", "callbacks"),
    (Diagnostics, "after_step", "diagnostics"),
    (Diagnostics, "after_rollout", "diagnostics"),
    (Diagnostics, "after_update", "diagnostics"),
    (HeldOutEvaluation, "run", "evaluations"),
    (Checkpoints, "save", "checkpoints"),
)
"""Methods, and what they are part of: SB3's own loop, and what the engine does inside it."""


class _Clock:
    """Adds up the CPU time of methods, each without the watched methods that it calls."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inner = [0.0]

    def watch(self, owner: type, method: str, label: str) -> None:
        """Time `owner.method` under `label` from now on."""
        original: Callable[..., Any] = getattr(owner, method)

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0.0)
            begin = time.process_time()
            try:
                return original(*arguments, **keywords)
            finally:
                spent = time.process_time() - begin
                own = spent - self._inner.pop()
                self._inner[-1] += spent
                self.seconds[label] = self.seconds.get(label, 0.0) + own

        setattr(owner, method, timed)


def _cpu_s(work: Callable[[TrainConfig], None], config: TrainConfig) -> float:
    begin = time.process_time()
    work(config)
    return time.process_time() - begin


def _alone(config: TrainConfig) -> None:
    """Train as SB3 does, with nothing around it."""
    vec_env = make_training_env(config)
    make_model(config, vec_env).learn(config.total_steps)
    vec_env.close()


def _whole(config: TrainConfig) -> None:
    with tempfile.TemporaryDirectory() as folder:
        training.train(config, Path(folder))


def _costs(run: TrainConfig, rounds: int, clock: _Clock) -> dict[str, Any]:
    """Return the ratios of one run, and the shares of the engine's parts in it."""
    beside, within, shares = [], [], []
    for _ in range(rounds):
        alone = _cpu_s(_alone, run)
        clock.seconds.clear()
        whole = _cpu_s(_whole, run)
        spent = dict(clock.seconds)
        beside.append(whole / alone)
        within.append(whole / spent.pop("learn"))
        shares.append({part: seconds / whole for part, seconds in spent.items()})
    return {
        "environment_steps": run.total_steps,
        "evaluated_every": run.evaluation.every_steps,
        "within": round(median(within), 3),
        "beside": [round(ratio, 3) for ratio in sorted(beside)],
        "shares": {part: round(median(s[part] for s in shares), 4) for part in shares[0]},
    }


def main() -> None:
    """Measure, print and keep the ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engine_cost")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    torch.set_num_threads(1)
    clock = _Clock()
    for owner, method, label in PARTS:
        clock.watch(owner, method, label)
    study = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    shipped = load_config(TrainConfig, ROOT / "configs" / "train" / "reach_clarke.yaml")
    found: dict[str, Any] = {"rounds": options.rounds}
    for run in (run for run in study.runs() if run.env.kwargs["n_tendons"] == 11):
        name = f"quick, {run.env.kwargs['representation']}"
        if name not in found:
            found[name] = _costs(run, options.rounds, clock)
            print(name, found[name], flush=True)
    found["reach_clarke"] = _costs(shipped, options.rounds, clock)
    print("reach_clarke", found["reach_clarke"], flush=True)
    keep("engine_cost", found)


if __name__ == "__main__":
    main()
