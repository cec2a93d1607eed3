"""Synthetic study folders in the agreed layout."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

METRICS = [
    {"name": "tip_error_m", "label": "tip error", "unit": "m", "worst": 0.4},
    {"name": "tip_error_percent", "label": "tip error", "unit": "% of length", "worst": 200.0},
]
GRID = np.arange(0, 200_001, 10_000)


def write_run(folder: Path, seed: int, speed: float, goals: int = 50) -> None:
    """Write one finished run whose success rises as a logistic with the given speed."""
    rng = np.random.default_rng(seed + int(1000 * speed))
    centre = 120_000 / speed * rng.lognormal(0.0, 0.12)
    rate = 1 / (1 + np.exp(-(GRID - centre) / 15_000))
    is_success = rng.random((GRID.size, goals)) < rate[:, None]
    error = (0.004 + 0.06 * (1 - rate[:, None])) * rng.lognormal(0.0, 0.4, is_success.shape)
    folder.mkdir(parents=True)
    np.savez(
        folder / "evals.npz",
        env_steps=GRID,
        is_success=is_success,
        tip_error_m=error,
        tip_error_percent=error / 0.2 * 100,
        episode_return=-error * 100,
    )
    (folder / "metrics.json").write_text(json.dumps(METRICS))
    manifest = {"git_sha": "0123456789abcdef", "git_dirty": False, "cpu_s": 360.0, "wall_s": 300.0}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    wall = GRID[1:] / 1000 * rng.uniform(0.9, 1.1)
    lines = [f"{s},{w:.3f}" for s, w in zip(GRID[1:], wall, strict=True)]
    (folder / "progress.csv").write_text("env_steps,wall_s\n" + "\n".join(lines) + "\n")
    (folder / "DONE").touch()


@pytest.fixture
def make_study(tmp_path: Path) -> Callable[..., Path]:
    """Return a writer of study folders: speeds[task][representation] = learning speed."""

    def make(speeds: Mapping[str, Mapping[str, float]], n_seeds: int = 3, **overrides: Any) -> Path:
        study = tmp_path / "study"
        arms = [
            {"name": f"{rep}_{i}", "representation": rep, "task": task, "seeds": [*range(n_seeds)]}
            for i, (task, row) in enumerate(speeds.items())
            for rep in row
        ]
        for arm in arms:
            speed = speeds[arm["task"]][arm["representation"]]
            for seed in arm["seeds"]:
                write_run(study / arm["name"] / f"seed_{seed:02d}", seed, speed)
        data = {
            "name": "synthetic",
            "title": "Raw tendon space against Clarke coordinates",
            "note": "",
            "baseline": "raw",
            "thresholds": {"success": 0.9},
            "tuning": "none: shared defaults",
            "arms": arms,
            "total_steps": int(GRID[-1]),
        }
        (study / "study.yaml").write_text(yaml.safe_dump(data | overrides))
        return study

    return make
