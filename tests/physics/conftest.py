"""Robots and commands that the physics tests share."""

import dataclasses

import numpy as np
import pytest

from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.joint_vector import JointVector

CONTROL_DT = 0.05


def robot_of(*counts, drive_lag=0.0, **segment):
    segments = tuple(Segment(n_tendons=n, **segment) for n in counts)
    return Robot(segments, actuator_time_constant_s=drive_lag)


def random_commands(robot, num_envs, steps, seed=0, off_manifold=True):
    """A random walk of commands within the environment's limits, half of it off the manifold."""
    rng = np.random.default_rng(seed)
    clarke = np.zeros((num_envs, robot.n_segments, 2))
    off = np.zeros((num_envs, robot.n_joints))
    for step in range(steps):
        clarke = clarke + rng.uniform(-7e-4, 7e-4, clarke.shape)
        off = np.clip(off + rng.uniform(-5e-5, 5e-5, off.shape), -2e-4, 2e-4)
        off = off - (off @ robot.encoder.T) @ robot.decoder.T
        yield JointVector.from_clarke(clarke, off if off_manifold and step % 2 else None)


def settle(physics, clarke, steps=40):
    """Hold a command until the robots are at rest."""
    command = JointVector.from_clarke(np.asarray(clarke, dtype=np.float64))
    for _ in range(steps):
        physics.step(command)
    return physics


@pytest.fixture
def tight_profiles(monkeypatch):
    """The fast profile with exactly solved steps: folded, and with every tendon by itself."""
    from clarke_gym.physics.mujoco import model as mjcf

    for name, folded in (("folded", True), ("whole", False)):
        tight = dataclasses.replace(mjcf.PROFILES["fast"], folded=folded, tolerance=1e-13)
        monkeypatch.setitem(mjcf.PROFILES, name, tight)


@pytest.fixture
def physics():
    return MujocoPhysics(robot_of(4), 3, CONTROL_DT, threads=1)
