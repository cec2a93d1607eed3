"""Versions, backends and a short self-check: ``python -m clarke_gym``."""

from __future__ import annotations

import importlib.metadata
import platform
import sys
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym
from clarke_gym import clarke, kinematics
from clarke_gym.control import make_controller

PACKAGES = ("gymnasium", "numpy", "mujoco", "stable_baselines3", "torch")


def versions() -> str:
    """Return a line with the versions of this package and of what it works with."""
    found = [f"clarke_gym {clarke_gym.__version__}", f"Python {platform.python_version()}"]
    for name in PACKAGES:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            found.append(f"{name} not installed")
    return ", ".join(found)


def _transform() -> str:
    worst = 0.0
    for n in range(3, 33):
        pair = np.array([0.3, -0.7])
        worst = max(
            worst, float(np.abs(clarke.to_clarke(clarke.from_clarke(pair, n)) - pair).max())
        )
    if worst > 1e-12:
        raise RuntimeError(f"there and back differs by {worst:.1e}")
    return f"3 to 32 tendons, there and back within {worst:.0e}"


def _kinematics() -> str:
    tip, _ = kinematics.segment_pose(np.array([np.pi / 2.0, 0.0]), 1.0)
    gap = float(np.abs(tip - np.array([2.0 / np.pi, 0.0, 2.0 / np.pi])).max())
    if gap > 1e-12:
        raise RuntimeError(f"a quarter circle ends {gap:.1e} away")
    return "a quarter circle ends where it should"


def _episode(physics: str) -> str:
    env: Any = gym.make(
        "clarke_gym/Reach-v0", n_tendons=7, representation="clarke", physics=physics
    )
    controller = make_controller("clarke_controller", env)
    observation, info = env.reset(seed=0)
    for _ in range(50):
        observation, _, _, _, info = env.step(controller.act(observation))
    env.close()
    error = 1e3 * float(info["tip_error_m"])
    if not info["is_success"]:
        raise RuntimeError(f"classical control misses the goal by {error:.1f} mm")
    return f"classical control reaches a goal within {error:.2f} mm"


def _picture() -> str:
    env: Any = gym.make(
        "clarke_gym/Reach-v0", render_mode="rgb_array", render_width=64, render_height=64
    )
    env.reset(seed=0)
    spread = float(np.ptp(env.render()))
    env.close()
    if spread < 50.0:
        raise RuntimeError("it is empty")
    backend = next((name for name in ("egl", "osmesa") if f"mujoco.{name}" in sys.modules), "glfw")
    return f"drawn without a window by {backend}"


CHECKS: tuple[tuple[str, Callable[[], str]], ...] = (
    ("transform", _transform),
    ("kinematics", _kinematics),
    ("constant curvature", lambda: _episode("constant_curvature")),
    ("MuJoCo", lambda: _episode("mujoco")),
    ("pictures", _picture),
)
"""What is checked, in this order."""


def main() -> int:
    """Print all of it.

    Returns
    -------
    int
        0, or 1 if a check has failed. Pictures may be missing: training needs none.
    """
    print(versions())
    failed = False
    for name, check in CHECKS:
        try:
            print(f"{name:18} ok: {check()}")
        except Exception as error:  # whatever is wrong is what the line says
            needed = name != "pictures"
            failed |= needed
            reason = " ".join(str(error).split())
            print(f"{name:18} {'FAILED' if needed else 'missing'}: {reason}")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
