"""One robot simulated by itself: fresh kinematics, any number of time steps, breaking down."""

import mujoco
import numpy as np
import pytest

from clarke_gym.numerics.batch import One
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots.joint_vector import JointVector

from .conftest import CONTROL_DT, random_commands, robot_of

OPTIONS = [{}, {"profile": "accurate"}, {"routing": "chord"}, {"actuation": "tension"}]


def walk(physics, steps, seed=0):
    """Random commands, half of them with slack tendons, for one robot."""
    for command in random_commands(physics.robot, 1, steps, seed=seed):
        physics.step(JointVector.from_state(One(), command.get_state()))
        yield physics.state


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_states_are_those_of_the_joint_angles_at_the_end_of_the_step(options):
    """Not of a time step before: a simulator of its own computes them anew from the angles."""
    physics = MujocoPhysics(robot_of(5, 3), One(), CONTROL_DT, **options)
    model = physics.chain.model
    fresh = mujoco.MjData(model)
    for k, state in enumerate(walk(physics, 8)):
        fresh.qpos[:] = physics.get_state()["qpos"][0]
        mujoco.mj_kinematics(model, fresh)
        np.testing.assert_array_equal(state.tip_position[0], fresh.site("tip").xpos)
        np.testing.assert_array_equal(state.tip_quaternion[0], fresh.xquat[-1])
        if k == 4:
            physics.reset(np.array([0]), np.full((1, 2, 2), 0.002))
            fresh.qpos[:] = physics.get_state()["qpos"][0]
            mujoco.mj_kinematics(model, fresh)
            np.testing.assert_array_equal(physics.state.tip_position[0], fresh.site("tip").xpos)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_a_restored_state_continues_bit_for_bit(options):
    first, other = (MujocoPhysics(robot_of(4), One(), CONTROL_DT, **options) for _ in range(2))
    list(walk(first, 5))
    list(walk(other, 3, seed=9))
    other.set_state(first.get_state())
    for a, b in zip(walk(first, 8, seed=1), walk(other, 8, seed=1), strict=True):
        np.testing.assert_array_equal(a.tip_position, b.tip_position)
        assert a.displacement_vector.parts == b.displacement_vector.parts


@pytest.mark.parametrize("substeps", [1, 2])
def test_a_control_step_may_be_a_single_time_step(substeps):
    robot, control_dt = robot_of(7), 5e-3 * substeps
    single = MujocoPhysics(robot, One(), control_dt, sim_dt_s=5e-3)
    batch = MujocoPhysics(robot, 1, control_dt, sim_dt_s=5e-3)
    for state, command in zip(walk(single, 30), random_commands(robot, 1, 30), strict=True):
        batch.step(command)
        np.testing.assert_array_equal(state.tip_position, batch.state.tip_position)


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("cause", [2e3, 1e6, "command"], ids=["later", "at once", "command"])
def test_breaking_down_is_flagged_and_leaves_no_trace(cause, options, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    broken, twin = (MujocoPhysics(robot_of(4), One(), CONTROL_DT, **options) for _ in range(2))
    list(walk(broken, 4))
    before = broken.get_state()["qpos"]
    command = JointVector([np.nan if cause == "command" else 0.0, 0.0])
    if cause != "command":
        state = broken.get_state()
        state["qvel"][:] = cause
        broken.set_state(state)
    broken.step(command)
    assert broken.state.diverged.tolist() == [True]
    assert np.isfinite(
        [*broken.state.tip_position[0], *broken.state.displacement_vector.parts]
    ).all()
    np.testing.assert_array_equal(broken.get_state()["qpos"], before)
    for physics in (broken, twin):
        physics.reset(np.array([0]), np.zeros((1, 1, 2)))
    for a, b in zip(walk(broken, 12, seed=1), walk(twin, 12, seed=1), strict=True):
        assert not a.diverged.any()
        np.testing.assert_array_equal(a.tip_position, b.tip_position)
    assert list(tmp_path.iterdir()) == []
