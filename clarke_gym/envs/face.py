"""What the scalar and the vector environment show alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.core import EnvCore
from clarke_gym.envs.observer import Blocks
from clarke_gym.kinematics.inverse_chain import inverse_kinematics
from clarke_gym.kinematics.poses import forward
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.registry import nearest
from clarke_gym.physics.base import Physics
from clarke_gym.representations import Representation
from clarke_gym.robots import Robot
from clarke_gym.tasks import Goal, Task

BEYOND_REACH = 0.05
"""How far beyond reach a goal may lie, over the robot's length: points that somebody has measured
on a real robot are never quite where a model's tip can be."""

RENDER_MODES = ("rgb_array", "depth_array")
"""Modes of the environments themselves."""


class Face:
    """Public properties and checkpoints on top of a core."""

    metadata: ClassVar[dict[str, Any]] = {
        "render_modes": ["rgb_array", "depth_array", "rgb_array_list", "human"],
        "render_fps": 20,
    }
    render_mode: str | None
    _core: EnvCore

    @property
    def robot(self) -> Robot:
        """The robot's description."""
        return self._core.robot

    @property
    def task(self) -> Task:
        """What is asked of the robot."""
        return self._core.task

    @property
    def goal(self) -> FloatArray:
        """The goals of now in SI units, shape (B, size)."""
        return self._core.episode.goal.copy()

    @property
    def parameters(self) -> FloatArray:
        """What tells the episodes of now (goals, paths, places of bodies), shape (B, p)."""
        return self._core.episode.parameters.copy()

    @property
    def steps(self) -> NDArray[np.int64]:
        """Control periods since the episodes of now began, shape (B,)."""
        return self._core.episode.steps.copy()

    @property
    def config(self) -> EnvConfig:
        """What the environment is composed of."""
        return self._core.config

    @property
    def physics(self) -> Physics:
        """The model that moves the robots; its `state` has what sensors can see, and more."""
        return self._core.physics

    @property
    def sensors(self) -> Blocks:
        """Where each sensor stands in an observation, with labels, units, scales and bounds."""
        return self._core.observer.blocks

    @property
    def difficulty(self) -> float:
        """How hard the episodes are that begin from now on, 0 to 1."""
        return self._core.task.difficulty

    def set_difficulty(self, difficulty: float | str) -> None:
        """Make the episodes that begin from now on easier or harder, for curricula.

        What an episode was laid out with stays its own: goals, paths, bodies, loads. Tolerances,
        pushes and pulls are the task's, and change at once.

        Parameters
        ----------
        difficulty : float or str
            In [0, 1], or "easy", "medium", "hard".

        Raises
        ------
        ValueError, TypeError
            If it is neither, or the task has no such episodes for this robot; nothing changes then.
        """
        self._core.set_difficulty(difficulty)

    @property
    def control(self) -> str:
        """What an action asks for, "increment" or "absolute"."""
        return self._core.config.control

    @property
    def control_dt(self) -> float:
        """Control period [s]."""
        return self._core.config.control_dt

    @property
    def episode_steps(self) -> int:
        """Steps after which an episode is truncated."""
        return self._core.episode.limit

    @property
    def action_representation(self) -> Representation:
        """The maps between actions and joint space."""
        return self._core.actions.representation

    @property
    def observation_representation(self) -> Representation:
        """The maps between observed joint-space blocks and joint space."""
        return self._core.observer.representation

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return self._core.state()

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self._core.restore(state)

    def _choose_rendering(self, render_mode: str | None) -> None:
        if render_mode is not None and render_mode not in RENDER_MODES:
            raise ValueError(
                f"render_mode must be None or one of {list(RENDER_MODES)} here (gym.make adds "
                f"'rgb_array_list' and 'human'), got {render_mode!r}"
            )
        self.render_mode = render_mode
        self.metadata = {  # type: ignore[misc]
            **type(self).metadata,
            "render_fps": self._core.config.render_fps,
        }

    def _frames(self, rows: Iterable[int]) -> tuple[Any, ...]:
        """Return pictures or depths of the environments `rows`; nothing without a render mode."""
        if self.render_mode is None:
            return ()
        config, pick = self._core.config, RENDER_MODES.index(self.render_mode)
        size = (config.render_width, config.render_height)
        return tuple(pair[pick] for pair in self._core.pictures(size, rows))


def check_options(
    options: dict[str, Any] | None, goal: Goal | None, rows: int, robot: Robot
) -> FloatArray | None:
    """Return the goals given in reset options.

    Parameters
    ----------
    options : dict or None
    goal : Goal or None
        The task's.
    rows : int
        Environments that are reset.
    robot : Robot

    Returns
    -------
    ndarray of shape (rows, goal size), or None

    Raises
    ------
    ValueError
        If the options hold something else, or impossible goals.

    Examples
    --------
    >>> check_options({"goal": [0.0, 0.0, 0.2]}, Goal(("x", "y", "z"), "m", 0.2), 1, Robot())
    array([[0. , 0. , 0.2]])
    """
    if not options:
        return None
    for name in options:
        if name != "goal":
            raise ValueError(
                f"reset options may hold 'goal' only, got {name!r}{nearest(name, ['goal'])}"
            )
    if goal is None:
        raise ValueError("options['goal'] needs a task with a goal")
    given = np.asarray(options["goal"], dtype=np.float64)
    size = len(goal.labels[goal.shown])
    if given.shape not in ((size,), (rows, size)) or not np.isfinite(given).all():
        raise ValueError(
            f"options['goal'] must be finite with the shape ({size},) or ({rows}, {size}), got "
            f"{options['goal']!r}"
        )
    _check_reach(given, goal, robot)
    return np.broadcast_to(given, (rows, size))


def _check_reach(given: FloatArray, goal: Goal, robot: Robot) -> None:
    """Refuse goals that are out of reach.

    No point of the backbone is farther from the base than the robot is long, and the tip, the last
    position of a goal, comes only where the bending limits let it.

    Raises
    ------
    ValueError
        With how far they are and the nearest place where the tip can be.
    """
    points = (given / goal.observed_scale)[..., goal.positions].reshape(-1, *goal.positions.shape)
    if not points.size:
        return
    bending, left = inverse_kinematics(
        points[:, -1],
        robot.lengths / robot.length_m,
        max_bending=robot.max_bending,
        tolerance=BEYOND_REACH / 20.0,
    )
    beyond = np.maximum(np.linalg.norm(points, axis=-1).max(-1) - 1.0, left)
    worst = beyond.argmax()
    if beyond[worst] <= BEYOND_REACH:
        return
    tip = forward(bending[worst], robot.lengths)[0]
    raise ValueError(
        f"options['goal'] lies out of reach by {beyond[worst]:.3g} lengths of the robot, at most "
        f"{BEYOND_REACH:g} is taken; the nearest place that its tip reaches is "
        f"{tip.round(4).tolist()} m"
    )
