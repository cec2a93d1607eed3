"""What other libraries reach with the environments: the examples, run as a reader runs them.

python -m benchmarks.use_with

Runs each `examples/with_*.py`, and SB3's PPO with its defaults; docs/results/measured/use_with.json
keeps shares of held-out goals, CPU times and versions.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import re
import resource
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium as gym

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import ROOT
from benchmarks.measured import keep

LIBRARIES = ("stable_baselines3", "torch", "torchrl", "skrl", "minari", "onnx")
REACHED = re.compile(r"(\d\.\d\d) of the goals")
STEPS, SEEDS, GOALS = 65_536, (0, 1), 100


def run(path: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run an example as a reader would, in a folder of its own."""
    return subprocess.run(
        [sys.executable, str(path)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


def example(path: Path) -> dict[str, Any]:
    """Return what an example reaches, what it says, and its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        done = run(path, Path(folder))
    done.check_returncode()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    reached = [float(share) for share in REACHED.findall(done.stdout)]
    return {"reached": reached, "cpu_s": round(spent, 1), "says": done.stdout.strip().splitlines()}


def defaults_of_sb3(seed: int) -> float:
    """Return the share of goals that PPO reaches with SB3's defaults on one environment."""
    from stable_baselines3 import PPO  # the tests that run examples need it for some alone

    keywords: dict[str, Any] = {"n_tendons": 7, "representation": "clarke"}
    env = gym.make("clarke_gym/Reach-v0", **keywords)
    model = PPO("MlpPolicy", env, seed=seed, device="cpu").learn(STEPS)
    held_out: Any = gym.make_vec("clarke_gym/Reach-v0", num_envs=GOALS, **keywords)
    observations, _ = held_out.reset(seed=9_000)
    for _ in range(49):
        actions, _ = model.predict(observations, deterministic=True)
        observations, *_, infos = held_out.step(actions)
    return float(infos["is_success"].mean())


def main() -> None:
    """Run everything; print and keep what it reached."""
    found: dict[str, Any] = {"versions": {name: version(name) for name in LIBRARIES}}
    for path in sorted((ROOT / "examples").glob("with_*.py")):
        found[path.stem] = example(path)
        print(path.stem, found[path.stem], flush=True)
    found["defaults of SB3"] = [defaults_of_sb3(seed) for seed in SEEDS]
    print("defaults of SB3", found["defaults of SB3"])
    keep("use_with", found)


if __name__ == "__main__":
    main()
