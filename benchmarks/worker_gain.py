"""What a second worker of a study gains, beside what the machine gains with a second process.

python -m benchmarks.worker_gain [--rounds 2]

Four runs of quick.yaml by one worker and by two, from their first steps on, and processes that only
compute, one and two at a time, in turn. docs/results/measured/worker_gain.json keeps the ratios.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from agents.files import ROOT
from agents.learning.config import TrainConfig, load_config
from agents.studies.config import StudyConfig
from agents.studies.executors import run_pool
from benchmarks.measured import keep


def _wall_s(runs: list[TrainConfig], workers: int) -> float:
    """Return how long runs take, from the first steps on: processes start once a study."""
    begin: list[float] = []

    def report(steps: int) -> None:
        if steps and not begin:
            begin.append(time.perf_counter())

    with tempfile.TemporaryDirectory() as folder:
        jobs = [(run, Path(folder) / str(i)) for i, run in enumerate(runs)]
        ends = list(run_pool(jobs, workers, report))
    assert all(end.outcome == "done" for end in ends), ends
    return time.perf_counter() - begin[0]


def _plain_s(count: int) -> float:
    """Return how long some processes take that only compute: what the machine itself allows."""
    code = "import numpy as np; a = np.ones((64, 64)); [np.tanh(a @ a.T) for _ in range(150_000)]"
    begin = time.perf_counter()
    running = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(count)]
    for process in running:
        process.wait()
    return time.perf_counter() - begin


def main() -> None:
    """Measure, print and keep the ratios."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.worker_gain")
    parser.add_argument("--rounds", type=int, default=2)
    rounds = parser.parse_args().rounds
    runs = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml").runs()[:4]
    gains, plain = [], []
    for _ in range(rounds):
        gains.append(_wall_s(runs, 1) / _wall_s(runs, 2))
        plain.append(2 * _plain_s(1) / _plain_s(2))
        print(f"two workers gain {gains[-1]:.2f}, two processes {plain[-1]:.2f}", flush=True)
    found = {"workers": gains, "processes": plain}
    keep("worker_gain", {name: [round(r, 2) for r in sorted(found[name])] for name in found})


if __name__ == "__main__":
    main()
