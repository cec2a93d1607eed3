"""Import paths that the documentation of 0.1.0 showed, as names for where things live now."""

from __future__ import annotations

import importlib
import sys

MOVED = {
    "layouts": "clarke.layouts",
    "modes": "clarke.modes",
    "presets": "robots.presets",
    "sampling": "clarke.sampling",
    "spaces": "kinematics.chain",
    "tension": "clarke.tension",
    "trajectories": "clarke.trajectories",
}
"""Module of 0.1.0 -> module of today."""


def keep() -> None:
    """Let ``import clarke_gym.OLD`` give the module that holds its names today."""
    for old, new in MOVED.items():
        sys.modules[f"clarke_gym.{old}"] = importlib.import_module(f"clarke_gym.{new}")
