"""What controllers see and do: observations in SI units, commands as actions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.envs.codecs import JOINT_BLOCKS
from clarke_gym.envs.core import EnvCore
from clarke_gym.representations.registry import Representation, make_representation
from clarke_gym.wrappers import RepresentationAction, RepresentationObservation
from clarke_gym.wrappers.vector import RepresentationAction as VectorAction
from clarke_gym.wrappers.vector import RepresentationObservation as VectorObservation

FloatArray = NDArray[np.float64]


@dataclass
class Sensed:
    """What a batch of observations says, in SI units."""

    command: FloatArray
    """Clarke coordinates of the command [m], (B, S, 2)."""
    displacement: FloatArray
    """Clarke coordinates of the measured displacements [m], (B, S, 2)."""
    tip: FloatArray
    """Tip position [m], (B, 3)."""
    goal: FloatArray
    """Goal position [m], (B, 3)."""


class ManifoldInterface:
    """Reads observations into SI units and writes commands as actions, for one environment.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose task has a goal position.

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its goal is no position.
    """

    def __init__(self, env: Any) -> None:
        core = getattr(env.unwrapped, "core", None)
        if not isinstance(core, EnvCore):
            raise TypeError(f"a controller needs a clarke_gym environment, got {env!r}")
        if core.task.goal_size != 3 or core.task.observation_size != 3:
            raise ValueError(
                f"the controllers steer the tip to a position; {type(core.task).__name__} asks "
                "for something else"
            )
        self.robot = core.robot
        self.control_dt = core.config.control_dt
        self.step_m = (core.robot.tendon_speeds * core.config.control_dt)[:, None]
        self._absolute = core.config.control == "absolute"
        self._scale = core.robot.joint_scale
        self._action = _representation_of(env, (RepresentationAction, VectorAction), core)
        self._observation = _representation_of(
            env, (RepresentationObservation, VectorObservation), core
        )

    def sense(self, observation: Any) -> Sensed:
        """Return the observations (B, k), or a dictionary of them, in SI units."""
        as_dict = isinstance(observation, dict)
        rows = np.atleast_2d(observation["observation"] if as_dict else observation)
        rows = rows.astype(np.float64)
        size = self._observation.size
        blocks = [
            self._observation.decode(rows[:, k * size : (k + 1) * size]) * self._scale
            for k in range(len(JOINT_BLOCKS))
        ]
        pairs = [(block @ self.robot.encoder.T).reshape(len(rows), -1, 2) for block in blocks]
        rest = rows[:, len(JOINT_BLOCKS) * size :]
        goal = np.atleast_2d(observation["desired_goal"]) if as_dict else rest[:, 3:6]
        length = self.robot.length_m
        return Sensed(pairs[0], pairs[1], rest[:, :3] * length, goal * length)

    def act(
        self, target: FloatArray, held: FloatArray, speed_share: float = 1.0
    ) -> NDArray[np.float32]:
        """Return actions that move the command from `held` towards `target`, both (B, S, 2) [m].

        All segments slow down together, so that the command runs along a straight line, at most at
        `speed_share` of the drives' speed limits.
        """
        change = target - held
        steps = np.hypot(change[..., 0], change[..., 1]) / (speed_share * self.step_m[:, 0])
        change = change / np.maximum(steps.max(axis=1), 1.0)[:, None, None]
        if self._absolute:
            wanted = (held + change) / self.robot.max_clarke[:, None]
        else:
            wanted = change / self.step_m
        joint = wanted.reshape(len(wanted), -1) @ self.robot.decoder.T
        action = self._action.encode(joint)
        if not self._action.polar:  # bases with long axes: keep the direction, give up some speed
            action = action / np.maximum(np.abs(action).max(axis=1, keepdims=True), 1.0)
        result: NDArray[np.float32] = np.clip(action, -1.0, 1.0).astype(np.float32)
        return result


def _representation_of(env: Any, wrappers: tuple[type, ...], core: EnvCore) -> Representation:
    """Return the representation of a wrapper in the stack; raw if there is none."""
    layer = env
    while layer is not layer.unwrapped:
        if isinstance(layer, wrappers):
            representation: Representation = layer.representation  # type: ignore[attr-defined]
            return representation
        layer = layer.env
    return make_representation("raw", core.robot)
