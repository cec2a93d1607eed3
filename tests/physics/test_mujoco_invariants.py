"""Textbook mechanics that any model of these robots must reproduce."""

import math

import mujoco
import numpy as np
import pytest

from clarke_gym import kinematics
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.physics.mujoco.discretisation import joint_positions
from clarke_gym.physics.mujoco.model import PROFILES, build_chain
from clarke_gym.robots import Segment
from clarke_gym.robots.joint_vector import JointVector

from .conftest import CONTROL_DT, robot_of, settle

WEIGHTLESS = (0.0, 0.0, 0.0)
ROD = Segment(disk_mass_kg=0.0)
SECOND_MOMENT = math.pi * ROD.backbone_diameter_m**4 / 64.0
FLEXURAL = ROD.youngs_modulus_pa * SECOND_MOMENT
LINE_DENSITY = ROD.density_kg_m3 * math.pi * ROD.backbone_diameter_m**2 / 4.0


def test_total_mass_is_rod_disks_and_payload():
    robot = robot_of(3, 4, disk_mass_kg=3e-3)
    model = build_chain(robot, PROFILES["fast"], payload_kg=0.02).model
    expected = 2 * (LINE_DENSITY * ROD.length_m + 10 * 3e-3) + 0.02
    assert model.body_mass.sum() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("elements", [1, 2, 3, 10])
def test_constant_curvature_is_met_to_fourth_order(elements):
    bend, length = 2.0, 1.0
    joints = joint_positions(length, elements)
    angles = np.concatenate([[0.0], np.cumsum(np.full(2 * elements, bend / (2 * elements)))])
    links = np.diff(np.concatenate([[0.0], joints, [length]]))
    tip = np.array([(np.sin(angles) * links).sum(), (np.cos(angles) * links).sum()])
    exact = np.array([1.0 - math.cos(bend), math.sin(bend)]) / bend
    error = np.linalg.norm(tip - exact)
    assert error < 6e-4 * (bend / elements) ** 4


def bare_chain(elements):
    profile = PROFILES["fast"].__class__(elements=elements, sim_dt_s=1e-4, folded=True)
    robot = robot_of(3, disk_mass_kg=0.0, damping_time_s=0.0)
    chain = build_chain(robot, profile, gravity_m_s2=WEIGHTLESS)
    chain.model.actuator_gainprm[:] = 0.0
    chain.model.actuator_biasprm[:] = 0.0
    return chain.model


def test_small_deflection_is_that_of_a_cantilever():
    model = bare_chain(10)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tip = model.site("tip").id
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, tip)
    force = np.array([1e-3, 0.0, 0.0])
    stiffness = model.jnt_stiffness
    deflection = jacobian @ (jacobian.T @ force / stiffness)
    exact = force[0] * ROD.length_m**3 / (3.0 * FLEXURAL)
    assert deflection[0] == pytest.approx(exact, rel=2e-3)


def test_first_bending_frequency_is_that_of_a_cantilever():
    model = bare_chain(10)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    stiffness = model.jnt_stiffness
    root = np.sqrt(stiffness)
    compliance = np.linalg.eigvalsh(inertia / np.outer(root, root)).max()
    exact = (1.8751040687 / ROD.length_m) ** 2 * math.sqrt(FLEXURAL / LINE_DENSITY)
    assert compliance**-0.5 == pytest.approx(exact, rel=5e-3)


@pytest.mark.parametrize("n", [3, 5, 8])
def test_bend_follows_the_commanded_clarke_coordinates(n):
    robot = robot_of(n, max_bending_rad=2.2)
    angles = np.radians([10.0, 60.0, 120.0])
    bending = np.stack([angles * math.cos(0.7), angles * math.sin(0.7)], axis=1)[:, None]
    physics = MujocoPhysics(robot, 3, CONTROL_DT, threads=1, gravity_m_s2=WEIGHTLESS)
    physics.reset(np.arange(3), bending * 0.01)
    settle(physics, bending * 0.01, 20)
    quaternion = physics.state.tip_quaternion
    bend = 2.0 * np.arccos(np.hypot(quaternion[:, 0], quaternion[:, 3]))
    np.testing.assert_allclose(bend, angles, rtol=0.01)


def test_turning_the_tendon_ring_turns_the_motion():
    clarke = np.array([[[0.006, 0.001]]])
    turn = 2.0 * math.pi / 5
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    tips = []
    for command in (clarke, clarke @ rotation.T):
        physics = MujocoPhysics(
            robot_of(5), 1, CONTROL_DT, profile="accurate", gravity_m_s2=WEIGHTLESS
        )
        tips.append(settle(physics, command).state.tip_position[0])
        tension = physics.tension[0]
        np.testing.assert_allclose(tension[len(tips) - 1], tension.max())
    turned = rotation @ tips[0][:2]
    np.testing.assert_allclose([*turned, tips[0][2]], tips[1], atol=1e-4 * 0.2)


def test_energy_decays_once_the_drives_hold():
    physics = MujocoPhysics(robot_of(3), 1, 0.005, gravity_m_s2=WEIGHTLESS)
    state = physics.get_state()
    state["qpos"][0] += 0.05 * physics._engine.chain.shape[:, 0]
    physics.set_state(state)
    model = physics._engine.chain.model
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    energies = []
    for _ in range(40):
        settle(physics, np.zeros((1, 1, 2)), 1)
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = physics._engine.qpos[0], physics._engine.qvel[0]
        mujoco.mj_forward(model, data)
        stretch = data.ten_length
        tendons = 0.5 * (model.actuator_gainprm[:, 0] * stretch**2).sum()
        energies.append(data.energy.sum() + tendons)
    assert (np.diff(energies) <= 1e-12 + 1e-9 * energies[0]).all()
    assert energies[-1] < 0.05 * energies[0]


@pytest.mark.parametrize("options", [{}, {"profile": "accurate"}], ids=str)
def test_tensions_balance_the_bending_moment(options):
    robot = robot_of(4, 3)
    bend = np.array([[[0.6, 0.2], [0.5, -0.3]]])
    clarke = np.asarray(kinematics.bending_to_clarke(bend, robot.pitch_radii))
    physics = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=WEIGHTLESS, **options)
    physics.reset(np.array([0]), clarke)
    settle(physics, clarke)
    tension = physics.tension
    assert (tension > 0.0).all()
    moment = (tension * np.repeat(robot.pitch_radii, robot.n_tendons)) @ (
        robot.decoder.reshape(robot.n_joints, -1, 2).sum(1)
    )
    # All tendons pass through the first segment, whose curvature they make.
    expected = FLEXURAL * bend[0, 0] / ROD.length_m
    np.testing.assert_allclose(moment[0], expected, atol=0.006 * np.linalg.norm(expected))


def test_tension_driven_robot_bends_by_the_moment_of_its_tensions():
    robot = robot_of(3)
    physics = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=WEIGHTLESS, actuation="tension")
    tension = np.array([[4.0, 0.0, 0.0]])
    clarke = (tension @ robot.encoder.T)[:, None]
    off = tension - clarke[:, 0] @ robot.decoder.T
    command = JointVector.from_clarke(clarke, off)
    for _ in range(40):
        physics.step(command)
    bend = physics.state.displacement_vector.clarke[0, 0, 0] / 0.01
    assert bend == pytest.approx(4.0 * 0.01 * ROD.length_m / FLEXURAL, rel=1e-4)
    np.testing.assert_allclose(physics.tension, tension, atol=1e-12)


@pytest.mark.parametrize("joint_type", ["rod", "bellows"])
def test_rods_and_bellows_push(joint_type):
    robot = robot_of(3, joint_type=joint_type, pretension_n=0.0)
    physics = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=WEIGHTLESS)
    settle(physics, np.array([[[0.005, 0.0]]]))
    assert physics.tension.min() < -0.5
    assert physics.state.displacement_vector.clarke[0, 0, 0] == pytest.approx(0.005, rel=2e-3)


def test_gravity_turns_with_the_base():
    robot = robot_of(3, disk_mass_kg=5e-3)
    half = math.sqrt(0.5)
    pose = {"base_position_m": (0.0, 0.0, 1.0), "base_quaternion": (half, 0.0, half, 0.0)}
    sideways = MujocoPhysics(robot, 1, CONTROL_DT, **pose)
    settle(sideways, np.zeros((1, 1, 2)))
    direct = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=(9.80665, 0.0, 0.0))
    settle(direct, np.zeros((1, 1, 2)))
    np.testing.assert_allclose(sideways.state.tip_position, direct.state.tip_position, atol=1e-7)
    assert direct.state.tip_position[0, 0] > 0.0
    tip = sideways.to_world(sideways.state.tip_position)[0]
    assert tip[0] == pytest.approx(0.2, rel=0.02)  # reaches out along the world's x
    assert 0.9 < tip[2] < 0.9999  # and sags below the base
