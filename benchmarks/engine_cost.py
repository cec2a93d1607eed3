"""What the engine costs over Stable-Baselines3 alone, and what a second worker gains.

python -m benchmarks.engine_cost [--rounds 9]

Runs by `train` (logging, diagnostics, evaluations, checkpoints) beside SB3's own `learn` with the
same model and environment, in turn; CPU time of the process, median of the ratios, for two runs of
quick.yaml and for reach_clarke.yaml, cut short, so that a drift of the machine meets both alike;
the same with evaluations at a run's ends alone. In the runs by `train` the parts are timed, each
without the parts within it. Then four runs of quick.yaml by one worker and by two,
beside processes that only compute. docs/results/measured/engine_cost.json keeps what was found.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import torch

from agents.files import ROOT
from agents.learning.checkpoint import Checkpoints
from agents.learning.config import TrainConfig, load_config
from agents.learning.diagnostics import Diagnostics
from agents.learning.evaluation import HeldOutEvaluation
from agents.learning.models import make_model, make_training_env
from agents.learning.training import train
from agents.studies.config import StudyConfig
from agents.studies.executors import run_pool
from benchmarks.measured import keep

STEPS = 20_480
"""Environment steps of the runs that are compared."""

PARTS = (
    (Diagnostics, "after_step", "diagnostics"),
    (Diagnostics, "after_rollout", "diagnostics"),
    (Diagnostics, "after_update", "diagnostics"),
    (HeldOutEvaluation, "run", "evaluations"),
    (Checkpoints, "save", "checkpoints"),
)
"""Methods that are the engine's, and what they are part of."""


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
        train(config, Path(folder))


def _wall_s(runs: list[TrainConfig], workers: int) -> float:
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        jobs = [(run, Path(folder) / str(i)) for i, run in enumerate(runs)]
        ends = list(run_pool(jobs, workers, lambda _: None))
    assert all(end.outcome == "done" for end in ends), ends
    return time.perf_counter() - begin


def _plain_s(count: int) -> float:
    """Return how long some processes take that only compute: what the machine itself allows."""
    code = "import numpy as np; a = np.ones((64, 64)); [np.tanh(a @ a.T) for _ in range(150_000)]"
    begin = time.perf_counter()
    running = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(count)]
    for process in running:
        process.wait()
    return time.perf_counter() - begin


def _costs(run: TrainConfig, rounds: int, clock: _Clock) -> dict[str, Any]:
    """Return the ratios of one run, and the shares of the engine's parts in it."""
    run = run.model_copy(update={"total_steps": STEPS})
    sparse = run.evaluation.model_copy(update={"every_steps": STEPS})
    seldom = run.model_copy(update={"evaluation": sparse})
    _alone(run)
    ratios, shares = [], []
    for _ in range(rounds):
        alone = _cpu_s(_alone, run)
        clock.seconds.clear()
        whole = _cpu_s(_whole, run)
        shares.append({part: spent / whole for part, spent in clock.seconds.items()})
        ratios.append((whole / alone, _cpu_s(_whole, seldom) / alone))
    every, ends = (median(values) for values in zip(*ratios, strict=True))
    return {
        "environment_steps": run.total_steps,
        "evaluated_every": run.evaluation.every_steps,
        "over_sb3": round(every, 3),
        "over_sb3_evaluated_at_its_ends": round(ends, 3),
        "shares": {part: round(median(s[part] for s in shares), 4) for part in shares[0]},
    }


def main() -> None:
    """Measure, print and keep the ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engine_cost")
    parser.add_argument("--rounds", type=int, default=9)
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
    runs = study.runs()[:4]
    rounds = max(1, options.rounds // 4)
    gains = [_wall_s(runs, 1) / _wall_s(runs, 2) for _ in range(rounds)]
    found["one_worker_over_two"] = round(median(gains), 2)
    found["plain_processes"] = [round(2 * _plain_s(1) / _plain_s(2), 2) for _ in range(rounds)]
    print(f"{len(runs)} runs: one worker takes {median(gains):.2f} times as long as two")
    keep("engine_cost", found)


if __name__ == "__main__":
    main()
