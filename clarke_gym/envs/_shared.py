"""What the scalar and the vector environment share on top of the core."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clarke_gym.envs.core import EnvCore
from clarke_gym.numerics.arrays import components

RENDER_MODES = ("rgb_array", "depth_array")


def goal_reward(core: EnvCore, achieved: ArrayLike, desired: ArrayLike) -> Any:
    """Return the task's reward of goals as observed, shape (..., goal_size)."""
    goals = [np.asarray(goal, dtype=np.float32) for goal in (achieved, desired)]
    lead = np.broadcast_shapes(*(goal.shape[:-1] for goal in goals))
    rows = [np.broadcast_to(goal, (*lead, goal.shape[-1])) for goal in goals]
    parts = [components(array.reshape(-1, array.shape[-1]), scalar=not lead) for array in rows]
    reward = core.task.reward(*parts)[0]
    return reward.reshape(lead) if lead else reward


def render_rows(core: EnvCore, mode: str | None, rows: Iterable[int]) -> tuple[Any, ...]:
    """Return pictures or depths of the environments `rows`; nothing without a render mode."""
    if mode is None:
        return ()
    size = (core.config.render_width, core.config.render_height)
    return tuple(pair[RENDER_MODES.index(mode)] for pair in core.pictures(size, rows))


def check_render_mode(render_mode: str | None, allowed: list[str]) -> None:
    """Refuse a render mode that the environment does not have."""
    if render_mode is not None and render_mode not in allowed:
        raise ValueError(f"render_mode must be None or one of {allowed}, got {render_mode!r}")


def check_options(options: dict[str, Any] | None, goal_size: int, rows: int) -> Any:
    """Return the goals given in reset options, shape (rows, goal_size), or None."""
    if not options:
        return None
    unknown = sorted(set(options) - {"goal"})
    if unknown:
        raise ValueError(f"reset options may hold 'goal' only, got {unknown}")
    goal = np.asarray(options["goal"], dtype=np.float64)
    if goal.shape not in ((goal_size,), (rows, goal_size)) or not np.isfinite(goal).all():
        raise ValueError(
            f"options['goal'] must be finite with the shape ({goal_size},) or "
            f"({rows}, {goal_size}), got {options['goal']!r}"
        )
    return np.broadcast_to(goal, (rows, goal_size))
