"""The batched core: the only implementation of an episode, scalar or vector."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from operator import sub
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym.envs.codecs import ActionCodec, ObservationCodec
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.episodes import EpisodeStreams, Parts
from clarke_gym.envs.limits import CommandLimits, Reading, largest_magnitude
from clarke_gym.numerics.arrays import FloatArray, Number, components, from_components
from clarke_gym.physics.base import JointVector, Physics
from clarke_gym.physics.constant_curvature import ConstantCurvature
from clarke_gym.robots.robot import Robot
from clarke_gym.tasks.base import Task
from clarke_gym.tasks.reach import Reach

if TYPE_CHECKING:
    from clarke_gym.rendering.picture import Picture

BOUND_MARGIN = 1.0 + 1e-5
"""Room for float32 rounding between a value and the bound of its space."""

FULL_LOAD = 2.0
"""Tension over pretension at which a tendon is drawn red."""

UNTENSIONED_LOAD_N = 20.0
"""The same tension [N] for a robot without pretension."""


def _make_physics(config: EnvConfig, robot: Robot, num_envs: int, scalar: bool) -> Physics:
    if config.physics == "mujoco":
        from clarke_gym.physics.mujoco import MujocoPhysics  # loads the simulator

        return MujocoPhysics(
            robot,
            num_envs,
            config.control_dt,
            profile=config.profile,
            threads=config.threads,
            sim_dt_s=config.sim_dt_s,
            payload_kg=config.payload_kg,
            scalar=scalar,
        )
    return ConstantCurvature(robot, num_envs, config.control_dt, scalar)


def _make_task(config: EnvConfig, robot: Robot) -> Task:
    return Reach(
        robot,
        reward=config.reward,
        success_tolerance=config.success_tolerance,
        random_start=config.random_start,
    )


class EnvCore:
    """A batch of B environments in joint space.

    Observations are float32 and scaled by the robot's limits, joint blocks first, then the task's
    part; with `goal_env`, dictionaries with ``achieved_goal`` and ``desired_goal``, too. They are
    new arrays in every call, with a row for each environment, or with none in the scalar one, in
    joint space unless `observer` is another codec.

    Parameters
    ----------
    config : EnvConfig
    num_envs : int
        Batch size B.
    scalar : bool
        Compute a batch of one with Python floats; same formulas, same bits, less overhead.
    """

    def __init__(self, config: EnvConfig, num_envs: int, scalar: bool = False) -> None:
        self.config = config
        self.num_envs = num_envs
        self._scalar = scalar
        self._goal_env = config.goal_env
        self._picture: Picture | None = None
        self.robot = robot = config.make_robot()
        self.physics = _make_physics(config, robot, num_envs, scalar)
        self.task = _make_task(config, robot)
        self._radii = robot.pitch_radii.tolist()
        self.streams = EpisodeStreams(num_envs, self.task.n_uniforms, self._prepare)
        self.steps = np.zeros(num_envs, dtype=np.int64)
        self.goal = np.zeros((num_envs, self.task.goal_size))
        self.limits = CommandLimits(robot, config.control, config.control_dt)
        self._desired = np.zeros((num_envs, self.task.goal_size), np.float32)
        start = np.zeros((num_envs, robot.n_segments, 2))
        self._command = JointVector.from_clarke(start, scalar=scalar)
        self.begun = False
        self.reader, self.observer = ActionCodec(self, "raw"), ObservationCodec(self, "raw")

    # --- spaces -------------------------------------------------------------------------------

    def joint_bounds(self) -> tuple[float, FloatArray]:
        """Return the bounds of the scaled joint blocks: on the manifold, and off it per tendon."""
        factor = BOUND_MARGIN * self.physics.displacement_bound
        return factor, factor * self.robot.max_cocontraction_m / self.robot.joint_scale

    def task_size(self) -> int:
        """Return how many numbers follow the joint blocks of an observation."""
        task = self.task
        return task.observation_size + (0 if self._goal_env else 2 * task.goal_size)

    def observation_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's observation in joint space."""
        # Positions are scaled by the length, which bounds them as the limits bound displacements.
        factor = self.joint_bounds()[0]
        goal = np.full(self.task.goal_size, factor, np.float32)
        task = np.full(self.task_size(), factor, np.float32)
        if not self._goal_env:
            task[-len(goal) :] *= 2.0
        observation = self.observer.space(spaces.Box(-task, task, dtype=np.float32))
        if not self._goal_env:
            return observation
        bounds = spaces.Box(-goal, goal, dtype=np.float32)
        return spaces.Dict(
            {"observation": observation, "achieved_goal": bounds, "desired_goal": bounds}
        )

    def single_or_batch(self, size: int) -> tuple[int, ...]:
        """Return the shape of arrays with `size` numbers for each environment."""
        return (size,) if self._scalar else (self.num_envs, size)

    # --- episodes -----------------------------------------------------------------------------

    def reset(self, rows: NDArray[np.intp], goal: FloatArray | None = None) -> None:
        """Start new episodes in the environments `rows`, at rest, command equal to displacement."""
        clarke, rest, sampled, desired = self.streams.draw(rows)
        if goal is not None:
            sampled, desired = goal, self.task.scale_goal(goal)
        self.physics.reset(rows, clarke, rest)
        self._command = self._command.with_rows(rows, clarke)
        pick = slice(None) if self._scalar else rows
        self.goal[pick] = sampled
        self._set_desired(pick, desired)
        self.steps[pick] = 0
        self.begun = True

    def _prepare(self, uniforms: FloatArray) -> Parts:
        """Return start (R, S, 2), coordinates there, goal (R, goal_size) and scaled goal."""
        bending, goal = self.task.sample(uniforms)
        bends = JointVector.from_clarke(bending).parts
        clarke = JointVector(kinematics.coupled(bends, self._radii)).clarke
        return clarke, self.physics.rest(clarke), goal, self.task.scale_goal(goal)

    def _set_desired(self, pick: NDArray[np.intp] | slice, desired: NDArray[np.float32]) -> None:
        """Bring the scaled goals up to date, as the next observation needs them."""
        self._desired[pick] = desired
        self._desired_parts = components(self._desired, self._scalar)

    def step(self, action: Reading) -> None:
        """Advance all environments by one control period."""
        if not self.begun:
            raise ResetNeeded("reset the environment before its first step")
        self._command = self.limits.apply(action, self._command)
        self.physics.step(self._command)
        if not self._scalar:  # Gymnasium's wrapper counts for the scalar environment
            self.steps += 1

    def reward(self) -> tuple[Number, dict[str, Any]]:
        """Return the rewards and the values for `info` of the current state.

        They are arrays of shape (B,), or numbers in the scalar environment.
        """
        state = self._state = self.physics.state
        self._achieved = self.task.achieved(state)
        reward, info = self.task.reward(self._achieved, self._desired_parts)
        off = self._command.off_manifold
        if off is not None:
            info["off_manifold_m"] = largest_magnitude(off)
        else:
            info["off_manifold_m"] = 0.0 if self._scalar else np.zeros(self.num_envs)
        info["diverged"] = state.diverged.item() if self._scalar else state.diverged.copy()
        return reward, info

    def observe(self) -> Any:
        """Return the observation of the state that `reward` was asked for, as new arrays."""
        achieved, desired = self._achieved, self._desired_parts
        task = achieved
        if not self._goal_env:
            task = [*achieved, *desired, *map(sub, desired, achieved)]
        observation = self.observer.write(self._command, self._state.displacement, task)
        if not self._goal_env:
            return observation
        reached, wanted = from_components(achieved, np.float32), self._desired.copy()
        return {
            "observation": observation,
            "achieved_goal": reached[0] if self._scalar else reached,
            "desired_goal": wanted[0] if self._scalar else wanted,
        }

    # --- pictures -----------------------------------------------------------------------------

    def pictures(self, size: tuple[int, int], rows: Iterable[int]) -> Iterator[tuple[Any, Any]]:
        """Yield (rgb, depth) of the environments `rows`; `size` is (width, height) in pixels."""
        if not self.begun:
            raise ResetNeeded("reset the environment before its first picture")
        if self._picture is None:
            from clarke_gym.rendering.picture import Picture  # loads OpenGL

            self._picture = Picture(self.robot, *size)
        points = max(segment.n_disks for segment in self.robot.segments)
        curves, load = self.physics.backbone(points), self._tendon_load()
        success = np.atleast_1d(self.reward()[1]["is_success"])
        for row in rows:
            yield self._picture.draw(
                curves[row], points, load[row], self.goal[row], bool(success[row])
            )

    def close(self) -> None:
        """Free what pictures hold; a second call does nothing."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _tendon_load(self) -> FloatArray:
        """Return each tendon's load, 0 to 1: tension, or without one how far it is pulled."""
        tension: FloatArray | None = getattr(self.physics, "tension", None)
        if tension is not None:
            full = [FULL_LOAD * s.pretension_n or UNTENSIONED_LOAD_N for s in self.robot.segments]
            return tension / np.repeat(full, self.robot.n_tendons)
        pulled = self.physics.state.displacement.joint(self.robot)
        return 0.5 + 0.5 * pulled / self.robot.joint_scale

    # --- checkpoints --------------------------------------------------------------------------

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as the recipe and the state: simulators do not pickle."""
        return EnvCore, (self.config, self.num_envs, self._scalar), self.state()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Return to a pickled state."""
        self.restore(state)

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return {
            "physics": self.physics.get_state(),
            "streams": self.streams.get_state(),
            "steps": self.steps.copy(),
            "goal": self.goal.copy(),
            "command": self._command.get_state(),
            "begun": self.begun,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self.physics.set_state(state["physics"])
        self.streams.set_state(state["streams"])
        self.steps = state["steps"].copy()
        self.goal = state["goal"].copy()
        self._set_desired(slice(None), self.task.scale_goal(self.goal))
        self._command = JointVector.from_state(state["command"], self._scalar)
        self.begun = state["begun"]
