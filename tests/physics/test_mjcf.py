"""An exported model is the simulated one, to the last digit, and its cables only pull."""

import mujoco
import numpy as np
import pytest

import clarke_gym
from clarke_gym.physics.mjcf import mjcf
from clarke_gym.physics.mujoco.model import PROFILES, build_chain
from clarke_gym.robots import make_robot
from clarke_gym.robots.scene import Capsule, Scene

NUMBERS = (
    "body_pos",
    "body_mass",
    "body_inertia",
    "body_ipos",
    "dof_damping",
    "jnt_stiffness",
    "actuator_gainprm",
    "actuator_biasprm",
    "actuator_forcerange",
    "wrap_prm",
    "geom_size",
    "geom_pos",
    "geom_quat",
    "body_quat",
    "body_iquat",
    "site_pos",
)

ODD = {
    "sim_dt_s": 0.05 / 13,
    "base_quaternion": (0.1, 0.5, -0.7, 0.5),
    "gravity_m_s2": (0.1 / 3.0, 0.0, -9.81 / 3.0),
    "payload_kg": 0.01 / 3.0,
    "scene": Scene((Capsule((0.1, 0.02, 0.03), (0.1, 0.2, 0.17), 0.01 / 3.0),)),
}


@pytest.mark.parametrize("options", [{}, {"folded": True}, {"routing": "chord"}, ODD])
@pytest.mark.parametrize("robot", ["hardware", make_robot(n_tendons=7, n_segments=2)])
def test_the_file_holds_the_very_same_numbers(robot, options):
    read = mujoco.MjModel.from_xml_string(mjcf(robot, profile="fast", **options))
    options = {"folded": False} | options
    built = build_chain(make_robot(robot), PROFILES["fast"], **options).model
    for name in NUMBERS:
        np.testing.assert_array_equal(getattr(read, name), getattr(built, name), err_msg=name)
    assert read.opt.timestep == built.opt.timestep
    np.testing.assert_array_equal(read.opt.gravity, built.opt.gravity)


def test_cables_pull_by_their_commanded_length_and_never_push(tmp_path):
    """The recipe of docs/use_with.md: pretension, a pull on one side, slack on the other."""
    robot = make_robot(n_tendons=4)
    segment = robot.segments[0]
    path = clarke_gym.export_mjcf(robot, tmp_path / "arm.xml", profile="fast")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.act[:] = model.tendon_length0 - segment.pretension_n / segment.tendon_stiffness_n_m
    mujoco.mj_step(model, data)
    np.testing.assert_allclose(-data.actuator_force, segment.pretension_n, rtol=1e-3)
    for _ in range(200):  # 5 mm in at 10 mm/s; the opposite tendon is paid out by 6 mm
        data.ctrl[:] = [-0.005, 0.0, 0.006, 0.0]
        mujoco.mj_step(model, data)
    tension = -data.actuator_force
    assert tension.min() >= 0.0
    assert tension[2] == 0.0
    assert tension[0] > 1.0
    assert data.site("tip").xpos[0] > 0.02


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    with pytest.raises(ValueError, match="profile must be one of"):
        clarke_gym.export_mjcf("default", tmp_path / "arm.xml", profile="slow")
    with pytest.raises(FileNotFoundError):
        clarke_gym.export_mjcf("default", tmp_path / "none" / "arm.xml")
    assert list(tmp_path.iterdir()) == []
