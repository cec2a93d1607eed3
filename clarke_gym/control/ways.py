"""Ways between bodies: shapes to pass on the way to a goal's, from a fixed sample of them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.kinematics import sample_dome
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots import Robot

VIAS = 256
"""Shapes that a way may pass."""

GOALS = 4
"""Shapes of the goal that are tried, those that the tendons reach first."""

PAIRS = 24
"""Shapes near either end from which ways that pass two are made."""

MARGIN = 0.05
"""Gap over the hull's radius that a way keeps."""


@lru_cache(maxsize=8)
def _vias(robot: Robot) -> FloatArray:
    """Return the shapes that ways may pass, the straight one first, (V, S, 2) [rad]."""
    rng = np.random.default_rng(0)  # the same shapes at every call
    shapes = sample_dome(rng.random((VIAS, robot.n_segments, 2)), robot.max_bending)
    return np.concatenate([np.zeros((1, *shapes.shape[1:])), shapes])


def _length(steps: FloatArray) -> FloatArray:
    """Return how far the slowest segment has to go (...), of steps (..., S, 2) [rad]."""
    longest: FloatArray = np.hypot(steps[..., 0], steps[..., 1]).max(-1)
    return longest


def clear_way(
    task: Any, bodies: FloatArray, start: FloatArray, goals: FloatArray
) -> list[FloatArray]:
    """Return the shapes to pass, the goal's last, so that the hull touches no body.

    Straight lines between shapes are looked at: to a goal's shape at once, by one of a fixed sample
    of shapes, or by two.

    Parameters
    ----------
    task : ObstructedTask
        Whose `leg` and `gaps` tell what is clear.
    bodies : ndarray, shape (K, 7)
        Ends of axes and radii [m].
    start : ndarray, shape (S, 2)
        [rad].
    goals : ndarray, shape (G, S, 2)
        Shapes that reach the goal [rad], the best one first.

    Returns
    -------
    list of ndarray, shape (S, 2)
        The first goal's shape alone where no clear way was found.

    Examples
    --------
    >>> import gymnasium as gym, clarke_gym
    >>> env = gym.make("clarke_gym/Nest-v0").unwrapped
    >>> _ = env.reset(seed=0)
    >>> task, start = env.task, np.zeros((2, 2))
    >>> len(clear_way(task, env.physics.state.bodies[0], start, start[None]))  # stay there
    1
    """
    least = min(MARGIN * task.hull_m, float(task.gaps(task.leg(start, start), bodies).min()))

    def is_clear(first: FloatArray, last: FloatArray) -> NDArray[np.bool_]:
        ends = np.broadcast_arrays(first, last)
        clear: NDArray[np.bool_] = task.gaps(task.leg(*ends), bodies).min(-1) >= least
        return clear

    goals = goals[:GOALS]
    at_once = is_clear(start, goals)
    if at_once.any():
        return [goals[at_once.argmax()]]
    vias = _vias(task.robot)
    there, to_there = is_clear(start, vias), _length(vias - start)
    for goal in goals:
        back = is_clear(vias, goal)
        far = to_there + _length(goal - vias)
        if (there & back).any():
            return [vias[np.where(there & back, far, np.inf).argmin()], goal]
        firsts, lasts = (
            np.argsort(np.where(good, cost, np.inf))[: min(PAIRS, int(good.sum()))]
            for good, cost in ((there, to_there), (back, _length(goal - vias)))
        )
        if len(firsts) and len(lasts):
            between = is_clear(vias[firsts][:, None], vias[lasts][None])
            steps = _length(vias[lasts][None] - vias[firsts][:, None])
            total = to_there[firsts][:, None] + steps + _length(goal - vias[lasts])
            total = np.where(between, total, np.inf)
            if np.isfinite(total).any():
                i, j = np.unravel_index(total.argmin(), total.shape)
                return [vias[firsts[i]], vias[lasts[j]], goal]
    return [goals[0]]
