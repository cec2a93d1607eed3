"""The batched core: the only implementation of an episode, scalar or vector."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym._arrays import FloatArray, map_rows
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.limits import CommandLimits
from clarke_gym.envs.uniforms import UniformStreams
from clarke_gym.physics.base import JointVector, Physics
from clarke_gym.physics.constant_curvature import ConstantCurvature
from clarke_gym.robots import Robot
from clarke_gym.tasks.base import Task
from clarke_gym.tasks.reach import Reach

JOINT_BLOCKS = ("command", "displacement")
"""Joint-space parts that lead every observation, N numbers each."""

BOUND_MARGIN = 1.0 + 1e-5
"""Room for float32 rounding between a value and the bound of its space."""

Observation = dict[str, NDArray[np.float32]]


def _make_physics(config: EnvConfig, robot: Robot, num_envs: int) -> Physics:
    if config.physics == "mujoco":
        from clarke_gym.physics.mujoco import MujocoPhysics  # needs the simulator

        return MujocoPhysics(robot, num_envs, config.control_dt)
    return ConstantCurvature(robot, num_envs, config.control_dt)


def _make_task(config: EnvConfig, robot: Robot) -> Task:
    return Reach(
        robot,
        reward=config.reward,
        success_tolerance=config.success_tolerance,
        random_start=config.random_start,
    )


class EnvCore:
    """A batch of B environments in joint space.

    Observations are dictionaries of ``observation`` (joint blocks first, then the task's part),
    ``achieved_goal`` and ``desired_goal``, float32, scaled by the robot's limits; new arrays in
    every call.

    Parameters
    ----------
    config : EnvConfig
    num_envs : int
        Batch size B.
    """

    def __init__(self, config: EnvConfig, num_envs: int) -> None:
        self.config = config
        self.num_envs = num_envs
        self.robot = robot = config.make_robot()
        self.physics = _make_physics(config, robot, num_envs)
        self.task = _make_task(config, robot)
        self.streams = UniformStreams(num_envs, self.task.n_uniforms)
        self.steps = np.zeros(num_envs, dtype=np.int64)
        self.goal = np.zeros((num_envs, self.task.goal_size))
        self._limits = CommandLimits(robot, config.control, config.control_dt)
        self._desired = self.task.scale_goal(self.goal)
        self._command = JointVector(np.zeros((num_envs, robot.n_segments, 2)))
        scale = np.repeat(robot.max_clarke, robot.n_tendons)
        decoder = (robot.decoder / scale[:, None]).T.astype(np.float32)
        self._joint_decoder = np.kron(np.eye(len(JOINT_BLOCKS), dtype=np.float32), decoder)
        self._off_manifold_scale = (1.0 / scale).astype(np.float32)

    # --- spaces -------------------------------------------------------------------------------

    def joint_bounds(self) -> tuple[float, FloatArray]:
        """Return the bounds of the scaled joint blocks: on the manifold, and off it per tendon."""
        factor = BOUND_MARGIN * self.physics.displacement_bound
        off = factor * self.robot.max_cocontraction_m * self._off_manifold_scale
        return factor, off.astype(np.float64)

    def _task_bound(self) -> float:
        return BOUND_MARGIN * self.physics.displacement_bound

    def observation_spaces(self) -> dict[str, spaces.Box]:
        """Return the space of each entry of one environment's observation."""
        manifold, off = self.joint_bounds()
        # A tendon nearer to the backbone than the pitch radius moves less: |row of D| <= 1 there.
        reach = manifold * np.linalg.norm(self.robot.decoder, axis=1) + off
        joint = np.tile(reach, len(JOINT_BLOCKS))
        task = np.full(self.task.observation_size, self._task_bound())
        goal = np.full(self.task.goal_size, self._task_bound())
        parts = [joint, task] if self.config.goal_env else [joint, task, goal, 2.0 * goal]
        bounds = {
            "observation": np.concatenate(parts),
            "achieved_goal": goal,
            "desired_goal": goal,
        }
        return {
            name: spaces.Box(-high.astype(np.float32), high.astype(np.float32), dtype=np.float32)
            for name, high in bounds.items()
        }

    def action_space(self) -> spaces.Box:
        """Return the joint-space action space of one environment: [-1, 1] for every tendon."""
        return spaces.Box(-1.0, 1.0, (self.robot.n_joints,), np.float32)

    # --- episodes -----------------------------------------------------------------------------

    def reset(self, rows: NDArray[np.intp], goal: FloatArray | None = None) -> None:
        """Start new episodes in the environments `rows`, at rest, command equal to displacement."""
        uniforms = self.streams.draw(rows)
        bending = self.task.sample_start(uniforms)
        clarke = kinematics.bending_to_clarke(bending, self.robot.pitch_radii)
        self.physics.reset(rows, clarke)
        off = self._command.off_manifold
        self._command = JointVector(
            self._command.clarke.copy(), None if off is None else off.copy()
        )
        self._command.clarke[rows] = clarke
        if self._command.off_manifold is not None:
            self._command.off_manifold[rows] = 0.0
        self.goal[rows] = self.task.sample_goal(uniforms) if goal is None else goal
        self._desired = self.task.scale_goal(self.goal)
        self.steps[rows] = 0

    def step(self, action: FloatArray) -> None:
        """Advance all environments by one control period under a decoded action (B, N)."""
        self._command = self._limits.apply(action, self._command)
        self.physics.step(self._command)
        self.steps += 1

    def reward(self) -> tuple[FloatArray, dict[str, Any]]:
        """Return the rewards (B,) and the arrays for `info` of the current state."""
        reward, info = self.task.reward(self.task.achieved(self.physics.state), self._desired)
        off = self._command.off_manifold
        info["off_manifold_m"] = np.zeros(self.num_envs) if off is None else np.abs(off).max(axis=1)
        info["diverged"] = self.physics.state.diverged.copy()
        return reward, info

    def observe(self) -> Observation:
        """Return the observation of the current state as new arrays."""
        state = self.physics.state
        vectors = (self._command, state.displacement)
        size = len(JOINT_BLOCKS) * self.robot.n_joints
        task_size = self.task.observation_size
        flat = [vector.clarke.reshape(self.num_envs, -1) for vector in vectors]
        joint = map_rows(np.concatenate(flat, axis=1).astype(np.float32), self._joint_decoder)
        achieved = self.task.achieved(state)
        desired = self._desired.copy()
        extra = 0 if self.config.goal_env else 2 * self.task.goal_size
        observation = np.empty((self.num_envs, size + task_size + extra), np.float32)
        observation[:, :size] = joint
        for block, vector in enumerate(vectors):
            if vector.off_manifold is not None:
                part = slice(block * self.robot.n_joints, (block + 1) * self.robot.n_joints)
                observation[:, part] += vector.off_manifold * self._off_manifold_scale
        if self.physics.displacement_bound > 1.0:
            limit = self.physics.displacement_bound
            np.clip(observation[:, :size], -limit, limit, out=observation[:, :size])
        observation[:, size : size + task_size] = achieved
        if not self.config.goal_env:
            goal_size = self.task.goal_size
            observation[:, -2 * goal_size : -goal_size] = desired
            observation[:, -goal_size:] = desired - achieved
        return {"observation": observation, "achieved_goal": achieved, "desired_goal": desired}

    # --- checkpoints --------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        off = self._command.off_manifold
        return {
            "physics": self.physics.get_state(),
            "streams": self.streams.get_state(),
            "steps": self.steps.copy(),
            "goal": self.goal.copy(),
            "command": copy.deepcopy((self._command.clarke, off)),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self.physics.set_state(state["physics"])
        self.streams.set_state(state["streams"])
        self.steps = state["steps"].copy()
        self.goal = state["goal"].copy()
        self._desired = self.task.scale_goal(self.goal)
        self._command = JointVector(*copy.deepcopy(state["command"]))
