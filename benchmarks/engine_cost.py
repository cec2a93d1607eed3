"""What the engine costs over Stable-Baselines3 alone, and what a second worker gains.

python -m benchmarks.engine_cost [--rounds 5]

Runs by `train` (logging, diagnostics, evaluations, checkpoints) beside SB3's own `learn` with the
same model and environment, in turn; CPU time of the process, median of the ratios. An evaluation
plays 100 episodes of 50 steps, so a study that evaluates every 1,024 steps plays five steps of
evaluation for one of training; what the engine costs besides is told by a run that evaluates at its
ends alone. Then four runs of quick.yaml by one worker and by two.
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

import torch

from agents.files import ROOT
from agents.learning.config import TrainConfig, load_config
from agents.learning.models import make_model, make_training_env
from agents.learning.training import train
from agents.studies.config import StudyConfig
from agents.studies.executors import run_pool


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
        train(config, Path(folder))


def _wall_s(runs: list[TrainConfig], workers: int) -> float:
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        jobs = [(run, Path(folder) / str(i)) for i, run in enumerate(runs)]
        ends = list(run_pool(jobs, workers, lambda _: None))
    assert all(end.outcome == "done" for end in ends), ends
    return time.perf_counter() - begin


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engine_cost")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    torch.set_num_threads(1)
    study = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    shipped = load_config(TrainConfig, ROOT / "configs" / "train" / "reach_clarke.yaml")
    dense = [run for run in study.runs() if run.env.kwargs["n_tendons"] == 11][:2]
    for run in [*dense, shipped]:
        sparse = run.evaluation.model_copy(update={"every_steps": run.total_steps})
        seldom = run.model_copy(update={"evaluation": sparse})
        _alone(run)
        ratios = []
        for _ in range(options.rounds):
            alone = _cpu_s(_alone, run)
            ratios.append((_cpu_s(_whole, run) / alone, _cpu_s(_whole, seldom) / alone))
        every, ends = (median(values) for values in zip(*ratios, strict=True))
        print(
            f"{run.name}, {run.total_steps:,} steps, evaluated every "
            f"{run.evaluation.every_steps:,}: {every:.3f} times SB3 alone; at its ends alone: "
            f"{ends:.3f}"
        )
    runs = study.runs()[:4]
    rounds = max(1, options.rounds // 2)
    gains = [_wall_s(runs, 1) / _wall_s(runs, 2) for _ in range(rounds)]
    print(f"{len(runs)} runs: one worker takes {median(gains):.2f} times as long as two")


if __name__ == "__main__":
    main()
