"""What controllers see and do: observations in SI units, commands as actions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.envs.face import Face
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.wrappers.codec import (
    ActionCodec,
    ObservationCodec,
    place_of,
    representation_of,
)

NEEDED = ("command", "displacement")
"""Sensors that controllers read."""


@dataclass
class Sensed:
    """What a batch of observations says, in SI units."""

    command: FloatArray
    """Clarke coordinates of the command [m], (B, S, 2)."""
    displacement: FloatArray
    """Clarke coordinates of the measured displacements [m], (B, S, 2)."""
    achieved: FloatArray
    """What is compared with the goal, in SI units, (B, k)."""
    goal: FloatArray
    """The goal without costs, in SI units, (B, k)."""


class JointInterface:
    """Reads joint space into SI units and writes commands as actions, for one environment.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment, made with keywords or wrapped by hand (`clarke_gym.wrappers`).

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its sensors do not suffice.
    """

    def __init__(self, env: Any) -> None:
        face = env.unwrapped
        if not isinstance(face, Face):
            raise TypeError(f"a controller needs a clarke_gym environment, got {env!r}")
        self._face = face
        self.task: Any = face.task
        missing = [name for name in self.needed() if name not in face.sensors]
        if missing:
            raise ValueError(f"a controller needs the sensors {missing}, got {list(face.sensors)}")
        self.robot, self.control_dt = face.robot, face.control_dt
        self.step_m = (face.robot.tendon_speeds * face.control_dt)[:, None]
        self._absolute = face.control == "absolute"
        self._action = representation_of(env, ActionCodec)
        self._observation = representation_of(env, ObservationCodec)
        self._blocks = [block for block in face.sensors.values() if block.reach is not None]
        self._places = {name: place_of(env, block) for name, block in face.sensors.items()}

    def needed(self) -> tuple[str, ...]:
        """Return the names of the sensors that are read."""
        return NEEDED

    def joints(self, observation: Any) -> dict[str, FloatArray]:
        """Return what sensors in joint space tell as Clarke coordinates [SI], (B, S, 2) each."""
        rows, pairs = self._rows(observation), {}
        for block in self._blocks:
            joints = self._observation.decode(rows[:, self._places[block.name]]) * block.scale
            pairs[block.name] = (joints @ self.robot.encoder.T).reshape(len(rows), -1, 2)
        return pairs

    @staticmethod
    def _rows(observation: Any) -> FloatArray:
        """Return observations (B, k), or those of a dictionary of them, in double precision."""
        as_dict = isinstance(observation, dict)
        rows = np.atleast_2d(observation["observation"] if as_dict else observation)
        return rows.astype(np.float64)

    @staticmethod
    def answer(observation: Any, actions: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return actions (B, k), or the only one (k,) where a single observation was asked of."""
        inner = observation["observation"] if isinstance(observation, dict) else observation
        return actions[0] if np.ndim(inner) == 1 else actions

    @property
    def bodies(self) -> FloatArray:
        """Bodies around the robots, shape (B, K, 7), as a camera would tell them."""
        return self._face.physics.state.bodies

    def periods(self, change: FloatArray, speed_share: float = 1.0) -> FloatArray:
        """Return how many control periods, at least one, changes (B, S, 2) [m] take, (B, 1, 1)."""
        periods = np.hypot(change[..., 0], change[..., 1]) / (speed_share * self.step_m[:, 0])
        return np.maximum(periods.max(axis=1), 1.0)[:, None, None]

    def act(
        self, target: FloatArray, held: FloatArray, speed_share: float = 1.0
    ) -> NDArray[np.float32]:
        """Return actions that move the command from `held` towards `target`, both (B, S, 2) [m].

        All segments slow down together, so that the command runs along a straight line, at most at
        `speed_share` of the drives' speed limits.
        """
        change = (target - held) / self.periods(target - held, speed_share)
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


class ManifoldInterface(JointInterface):
    """The same, and reads the goal and what is compared with it.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose task has a goal.

    Raises
    ------
    TypeError, ValueError
        If it is another environment, it has no goal, or its sensors do not suffice.
    """

    def __init__(self, env: Any) -> None:
        super().__init__(env)
        goal, sensors = self.task.goal, self._face.sensors
        self._shown, self._goal_scale = goal.shown, goal.observed_scale
        self._tip = sensors["tip_position"] if goal.is_position else None

    def needed(self) -> tuple[str, ...]:
        """Return the names of the sensors that are read."""
        goal = self.task.goal
        if goal is None:
            raise ValueError(
                f"the controllers need a goal to plan for; {type(self.task).__name__} has none"
            )
        self.is_position: bool = goal.is_position
        if goal.is_position:
            return (*NEEDED, "tip_position")
        return NEEDED if self._face.config.goal_env else (*NEEDED, "goal_gap")

    def sense(self, observation: Any) -> Sensed:
        """Return the observations (B, k), or a dictionary of them, in SI units."""
        rows, pairs = self._rows(observation), self.joints(observation)
        as_dict = isinstance(observation, dict)
        if as_dict or "goal" not in self._places:
            goal = np.atleast_2d(observation["desired_goal"]).astype(np.float64)[:, self._shown]
        else:
            goal = rows[:, self._places["goal"]]
        if self._tip is not None:
            achieved = rows[:, self._places["tip_position"]] * self._tip.scale
        elif as_dict:
            achieved = np.atleast_2d(observation["achieved_goal"]).astype(np.float64)
            achieved = achieved[:, self._shown] * self._goal_scale
        else:
            achieved = (goal - rows[:, self._places["goal_gap"]]) * self._goal_scale
        return Sensed(pairs["command"], pairs["displacement"], achieved, goal * self._goal_scale)

    @property
    def goal_scale(self) -> Any:
        """What the goal's numbers are divided by where policies see them."""
        return self._goal_scale
