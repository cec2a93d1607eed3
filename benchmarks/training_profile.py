"""Where the wall time of PPO goes: Stable-Baselines3 and torch, or our code.

python -m benchmarks.training_profile
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from agents.files import ROOT
from agents.learning.config import load_config
from agents.learning.evaluation import HeldOutEvaluation
from agents.learning.policies import PolicyAgent
from agents.learning.training import train
from agents.studies.config import StudyConfig
from clarke_gym.integrations.sb3 import Sb3VecEnv

POLICY = "policy in evaluations"


class _Clock:
    """Adds up the wall time of methods, each without the watched methods that it calls."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._inner = [0.0]

    def watch(self, owner: type, method: str, label: str) -> None:
        """Time `owner.method` under `label` from now on."""
        original: Callable[..., Any] = getattr(owner, method)

        def timed(*arguments: Any, **keywords: Any) -> Any:
            self._inner.append(0.0)
            begin = time.perf_counter()
            try:
                return original(*arguments, **keywords)
            finally:
                spent = time.perf_counter() - begin
                own = spent - self._inner.pop()
                self._inner[-1] += spent
                self.seconds[label] = self.seconds.get(label, 0.0) + own

        setattr(owner, method, timed)


def main() -> None:
    """Train one run of quick.yaml per representation and print the shares."""
    clock = _Clock()
    clock.watch(Sb3VecEnv, "step_wait", "environment step and adapter")
    clock.watch(Sb3VecEnv, "reset", "environment step and adapter")
    clock.watch(HeldOutEvaluation, "run", "held-out evaluation without the policy")
    clock.watch(PolicyAgent, "act", POLICY)
    study = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    for run in study.runs()[2:4]:
        clock.seconds.clear()
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            train(run, Path(folder))
            total = time.perf_counter() - begin
        policy = clock.seconds.pop(POLICY)  # a forward pass: Stable-Baselines3 and torch
        rest = total - sum(clock.seconds.values())
        print(f"{run.name}: {total:.1f} s wall, {run.total_steps} environment steps")
        print(f"  Stable-Baselines3 and torch                 {rest / total:6.1%}   (bar >= 80 %)")
        print(f"    of which the policy in evaluations        {policy / total:6.1%}")
        for label, seconds in clock.seconds.items():
            print(f"  {label:42s}  {seconds / total:6.1%}")


if __name__ == "__main__":
    main()
