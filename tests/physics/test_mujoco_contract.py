"""What every user of the physics may rely on: determinism, states, divergence, clear errors."""

import math

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from clarke_gym.numerics.batch import Many, One
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.physics.mujoco.tendons import TendonSprings
from clarke_gym.robots import Segment
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.materials import MATERIALS
from clarke_gym.robots.presets import make_robot

from .conftest import CONTROL_DT, random_commands, robot_of


def command_of(command, scalar, row=slice(None)):
    """A row of a batch's command, as the physics of one robot takes it."""
    arrays = command.get_state()
    off = arrays["off_manifold"]
    off = None if off is None else off[row]
    clarke = arrays["clarke"][row]
    return JointVector.from_clarke(clarke, off, One() if scalar else Many(len(clarke)))


def trace(physics, commands, rows=slice(None)):
    states = []
    for command in commands:
        physics.step(command_of(command, False, rows))
        state = physics.state
        states.append(np.hstack([state.tip_position, state.tip_quaternion, state.displacement]))
    return np.stack(states)


@pytest.mark.parametrize("robot", [robot_of(3), robot_of(7, 4)], ids=["one", "two"])
def test_rows_do_not_depend_on_threads_or_batch_size(robot):
    commands = list(random_commands(robot, 5, 12))
    together = trace(MujocoPhysics(robot, 5, CONTROL_DT, threads=1), commands)
    threaded = trace(MujocoPhysics(robot, 5, CONTROL_DT, threads=2), commands)
    alone = trace(MujocoPhysics(robot, 1, CONTROL_DT), commands, slice(3, 4))
    np.testing.assert_array_equal(together, threaded)
    np.testing.assert_array_equal(together[:, 3:4], alone)


@pytest.mark.parametrize(
    "options",
    [{}, {"profile": "accurate"}, {"routing": "chord"}, {"actuation": "tension"}],
    ids=str,
)
@pytest.mark.parametrize("off_manifold", [False, True], ids=["taut", "slack"])
@pytest.mark.parametrize("counts", [(7,), (5, 4)], ids=str)
def test_a_robot_simulated_alone_has_the_bits_of_a_row(counts, off_manifold, options):
    """Floats and a simulation of its own for one robot, arrays and a batch for many."""
    robot = robot_of(*counts)
    single = MujocoPhysics(robot, One(), CONTROL_DT, **options)
    batch = MujocoPhysics(robot, 3, CONTROL_DT, threads=1, **options)
    slack = 0
    for command in random_commands(robot, 3, 20, off_manifold=off_manifold):
        single.step(command_of(command, True, slice(1, 2)))
        batch.step(command)
        for field in ("tip_position", "tip_quaternion"):
            np.testing.assert_array_equal(
                getattr(single.state, field)[0], getattr(batch.state, field)[1]
            )
        for field in ("tension", "velocity"):
            np.testing.assert_array_equal(getattr(single, field)[0], getattr(batch, field)[1])
        np.testing.assert_array_equal(single.backbone(4)[0], batch.backbone(4)[1])
        slack += int((batch.tension <= 0.0).any())
    assert bool(slack) or not off_manifold


@pytest.mark.parametrize("options", [{}, {"profile": "accurate"}, {"routing": "chord"}], ids=str)
def test_restored_state_continues_bit_for_bit(options):
    robot = robot_of(3)
    first = MujocoPhysics(robot, 2, CONTROL_DT, threads=1, **options)
    other = MujocoPhysics(robot, 2, CONTROL_DT, threads=1, **options)
    commands = list(random_commands(robot, 2, 12))
    trace(first, commands[:6])
    other.set_state(first.get_state())
    np.testing.assert_array_equal(other.state.tip_position, first.state.tip_position)
    np.testing.assert_array_equal(trace(other, commands[6:]), trace(first, commands[6:]))


@pytest.fixture
def contacts(monkeypatch):
    """Three rods that stand beside the robot: contact, for which the solver iterates.

    Without constraints a step does not depend on where the solver starts.
    """
    from clarke_gym.physics.mujoco import links

    compile_alone = links.Backbone.compile

    def among_rods(backbone, folded):
        spec = backbone._spec
        for geom in spec.geoms:
            geom.contype, geom.conaffinity = 2, 0
        for x, y in ((0.013, 0.0), (0.0, 0.013), (-0.013, 0.0)):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                size=[0.002, 0.3, 0.0],
                pos=[x, y, 0.3],
                contype=2,
                conaffinity=2,
            )
        spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
        return compile_alone(backbone, folded)

    monkeypatch.setattr(links.Backbone, "compile", among_rods)


ENGINES = pytest.mark.parametrize("scalar", [True, False], ids=["single", "batch"])
MODELS = pytest.mark.parametrize(
    "options",
    [{}, {"profile": "accurate"}, {"routing": "chord"}, {"actuation": "tension"}],
    ids=str,
)


@pytest.mark.usefixtures("contacts")
@ENGINES
@MODELS
def test_a_fresh_simulation_continues_a_state_bit_for_bit(options, scalar):
    robot = robot_of(5, 4)
    first, other = (
        MujocoPhysics(robot, One() if scalar else 1, CONTROL_DT, threads=1, **options)
        for _ in range(2)
    )
    slack = 0
    for k, command in enumerate(random_commands(robot, 1, 24)):
        target = command_of(command, scalar)
        if k == 12:
            other.set_state(first.get_state())
        first.step(target)
        if k >= 12:
            slack += int((first.tension <= 0.0).any())
            other.step(target)
            ours, theirs = first.get_state(), other.get_state()
            for name in ("qpos", "qvel", "qacc_warmstart"):
                np.testing.assert_array_equal(ours[name], theirs[name])
            np.testing.assert_array_equal(first.tension, other.tension)
    assert slack > 3


@pytest.mark.usefixtures("contacts")
@ENGINES
@MODELS
def test_nothing_is_left_of_what_a_robot_did_before_its_reset(options, scalar):
    robot = robot_of(5, 4)
    used, fresh = (
        MujocoPhysics(robot, One() if scalar else 1, CONTROL_DT, threads=1, **options)
        for _ in range(2)
    )
    for command in random_commands(robot, 1, 8):
        used.step(command_of(command, scalar))
    for physics in (used, fresh):
        physics.reset(np.array([0]), np.full((1, 2, 2), 1e-3))
    for command in random_commands(robot, 1, 8, seed=1):
        for physics in (used, fresh):
            physics.step(command_of(command, scalar))
        np.testing.assert_array_equal(used.get_state()["qpos"], fresh.get_state()["qpos"])


@pytest.mark.usefixtures("contacts")
@MODELS
def test_in_contact_too_a_robot_alone_has_the_bits_of_a_row(options):
    """Whether or not it goes slack, and whatever the rows beside it do."""
    robot = robot_of(5, 4)
    single = MujocoPhysics(robot, One(), CONTROL_DT, **options)
    batch = MujocoPhysics(robot, 3, CONTROL_DT, threads=1, **options)
    for k, command in enumerate(random_commands(robot, 3, 12)):
        if command.off_manifold is not None and k % 4 == 1:
            command.off_manifold[:, 1] = 0.0  # the others alone go slack
        single.step(command_of(command, True, slice(1, 2)))
        batch.step(command)
        if k == 7:
            single.reset(np.array([0]), np.full((1, 2, 2), 1e-3))
            batch.reset(np.array([1]), np.full((1, 2, 2), 1e-3))
        for name in ("qpos", "qvel", "qacc_warmstart"):
            np.testing.assert_array_equal(single.get_state()[name][0], batch.get_state()[name][1])


@pytest.mark.parametrize("segments", [1, 2, 3])
@pytest.mark.parametrize("scalar", [True, False], ids=["single", "batch"])
def test_motion_with_slack_tendons_hardly_depends_on_the_time_step(segments, scalar):
    """From limit to limit: no more than 0.1 % of the length from a time step of 0.1 ms."""
    robot = robot_of(*[3] * segments, drive_lag=0.05)
    coarse, fine = (
        MujocoPhysics(robot, One() if scalar else 1, CONTROL_DT, threads=1, sim_dt_s=step)
        for step in (None, 1e-4)
    )
    target = np.random.default_rng(segments).choice([-1.0, 1.0], robot.n_joints) * 2e-3
    slack, errors = 0, []
    for k in range(20):
        raw = target if k // 5 % 2 else -target
        clarke = raw @ robot.encoder.T
        off = 0.1 * (raw - clarke @ robot.decoder.T)
        for physics in (coarse, fine):
            command = clarke.reshape(1, -1, 2), off[None], One() if scalar else Many(1)
            physics.step(JointVector.from_clarke(*command))
        slack += int((fine.tension <= 0.0).any())
        errors.append(coarse.state.tip_position - fine.state.tip_position)
    assert slack > 3
    rms = np.sqrt((np.array(errors) ** 2).sum(-1).mean())
    assert rms < 1e-3 * robot.length_m


@pytest.mark.usefixtures("tight_profiles")
@pytest.mark.parametrize("counts", [(3,), (5, 3), (32,)], ids=str)
def test_folded_tendons_equal_all_tendons_while_taut(counts):
    robot = robot_of(*counts)
    folded, whole = (
        MujocoPhysics(robot, 4, CONTROL_DT, threads=1, profile=profile, sim_dt_s=1e-3)
        for profile in ("folded", "whole")
    )
    for command in random_commands(robot, 4, 10, off_manifold=False):
        folded.step(command)
        whole.step(command)
        assert (whole.tension > 0.0).all()
        np.testing.assert_allclose(
            folded.state.tip_position, whole.state.tip_position, rtol=0.0, atol=1e-10
        )
        np.testing.assert_allclose(folded.tension, whole.tension, rtol=0.0, atol=1e-6)


@pytest.mark.usefixtures("tight_profiles")
@pytest.mark.parametrize("layout", ["symmetric", "irregular"])
def test_motion_with_slack_tendons_is_that_of_all_tendons_at_a_fine_step(layout):
    options = {}
    if layout == "irregular":
        options = {
            "tendon_angles_rad": (0.1, 1.2, 2.9, 4.0, 5.3),
            "tendon_radii_m": (0.01, 0.011, 0.009, 0.01, 0.012),
        }
    robot = robot_of(5, **options)
    folded = MujocoPhysics(robot, 4, CONTROL_DT, threads=1)
    whole = MujocoPhysics(robot, 4, CONTROL_DT, threads=1, profile="whole", sim_dt_s=2e-4)
    errors, slack = [], 0
    for command in random_commands(robot, 4, 24):
        folded.step(command)
        whole.step(command)
        slack += int((whole.tension == 0.0).any())
        errors.append(folded.state.tip_position - whole.state.tip_position)
    assert slack > 3
    rms = np.sqrt((np.array(errors) ** 2).sum(-1).mean())
    assert rms < 6e-4 * robot.length_m


@given(
    st.lists(st.floats(-6e-5, 6e-5), min_size=8, max_size=8),
    st.lists(st.floats(-1e-5, 1e-5), min_size=8, max_size=8),
)
def test_the_quick_look_never_overlooks_a_slack_tendon(numbers, rates):
    """What it calls taut, the look at every tendon and time step calls taut, too."""
    springs, steps = TendonSprings(robot_of(3, 7)), 3
    first, extra = numbers[:4], numbers[4:]
    lengths = np.array(extra) * np.arange(steps)[:, None] / steps
    gap = lengths - first - np.arange(1, steps + 1)[:, None] * rates[:4]
    drive = JointVector.from_clarke(np.zeros((1, 2, 2)))
    slack = springs.slack(drive, drive, gap[None])[0]
    last = [start + steps * rate for start, rate in zip(first, rates[:4], strict=True)]
    quick = springs.surely_taut(first, last, lengths[:-1].T.tolist(), lengths[-1].tolist())
    event(f"quick {quick}, slack {slack}")
    assert not (quick and slack)


def test_slack_tendons_carry_nothing_and_the_others_balance():
    robot = robot_of(3, pretension_n=0.0)
    physics = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=(0.0, 0.0, 0.0))
    loose = np.full((1, 3), -1e-4)
    for _ in range(40):
        physics.step(JointVector.from_clarke(np.array([[[0.005, 0.0]]]), loose))
    tension = physics.tension[0]
    assert tension[0] > 0.0
    np.testing.assert_array_equal(tension[1:], 0.0)
    # The pull side has to take up the slack of 0.1 mm and its own stretch first.
    stretch = tension[0] / robot.segments[0].tendon_stiffness_n_m
    achieved = physics.state.displacement_vector.clarke[0, 0, 0]
    assert achieved == pytest.approx(0.005 - 1e-4 - stretch, abs=1e-9)


@pytest.mark.parametrize("speed", [2e3, 1e6])  # in the middle of a control step, and at once
def test_divergence_is_flagged_contained_and_resettable(physics, speed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command = JointVector.from_clarke(np.zeros((3, 1, 2)))
    state = physics.get_state()
    state["qvel"][1] = speed
    physics.set_state(state)
    twin = MujocoPhysics(physics.robot, 3, CONTROL_DT, threads=1)
    for _ in range(3):
        physics.step(command)
        twin.step(command)
    assert physics.state.diverged.tolist() == [False, True, False]
    assert np.isfinite(physics.state.tip_position).all()
    assert np.isfinite(physics.state.displacement_vector.clarke).all()
    neighbours = [0, 2]
    np.testing.assert_array_equal(
        physics.state.tip_position[neighbours], twin.state.tip_position[neighbours]
    )
    physics.reset(np.array([1]), np.zeros((1, 1, 2)))
    assert not physics.state.diverged.any()
    twin.reset(np.array([1]), np.zeros((1, 1, 2)))
    for later in random_commands(physics.robot, 3, 24):  # slack tendons and all
        physics.step(later)
        twin.step(later)
        assert not physics.state.diverged.any()
        np.testing.assert_array_equal(physics.state.tip_position, twin.state.tip_position)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("num_envs", [1, 2])
@pytest.mark.parametrize("profile", ["fast", "accurate"])
@pytest.mark.parametrize("representation", ["raw", "clarke"])
def test_stepping_on_after_all_have_diverged_stays_finite(num_envs, profile, representation):
    keywords = {"n_tendons": 4, "profile": profile, "representation": representation}
    envs = gym.make_vec(
        "clarke_gym/Reach-v0", num_envs=num_envs, physics="mujoco", autoreset_mode="disabled",
        **keywords,
    )  # fmt: skip
    env = gym.make("clarke_gym/Reach-v0", physics="mujoco", **keywords)
    for each in (envs, env):
        each.reset(seed=0)
        core = each.unwrapped._core
        state = core.state()
        state["physics"]["qvel"][:] = 1e6
        core.restore(state)
        for _ in range(3):
            observation, reward, terminated, _, info = each.step(each.action_space.sample())
            assert np.isfinite(observation).all()
            assert np.isfinite(reward).all()
            assert np.all(terminated)
            assert np.all(info["diverged"])
            if each is envs:
                break  # an ended batch has to be reset first


@pytest.mark.filterwarnings("ignore:invalid value")
def test_a_command_that_is_not_a_number_diverges_only_its_row(physics):
    clarke = np.zeros((3, 1, 2))
    clarke[0] = np.nan
    physics.step(JointVector.from_clarke(clarke))
    assert physics.state.diverged.tolist() == [True, False, False]
    assert np.isfinite(physics.state.tip_position).all()


def test_reset_starts_at_rest_near_the_commanded_shape():
    robot = robot_of(4, 5)
    clarke = np.array([[[0.004, -0.002], [0.002, 0.003]]])
    physics = MujocoPhysics(robot, 1, CONTROL_DT, gravity_m_s2=(0.0, 0.0, 0.0))
    physics.reset(np.array([0]), clarke)
    start = physics.state.tip_position
    np.testing.assert_allclose(physics.state.displacement_vector.clarke, clarke, atol=4e-5)
    for _ in range(20):
        physics.step(JointVector.from_clarke(clarke))
    assert np.linalg.norm(physics.state.tip_position - start) < 1e-3 * robot.length_m


def test_backbone_runs_from_base_to_tip():
    physics = MujocoPhysics(robot_of(3, 3), 2, CONTROL_DT)
    physics.reset(np.arange(2), np.full((2, 2, 2), 0.003))
    curve = physics.backbone(8)
    assert curve.shape == (2, 17, 3)
    np.testing.assert_array_equal(curve[:, 0], 0.0)
    np.testing.assert_allclose(curve[:, -1], physics.state.tip_position, atol=1e-12)
    assert np.linalg.norm(np.diff(curve, axis=1), axis=-1).max() <= 0.025 + 1e-12


def test_velocity_is_the_rate_of_the_displacement():
    robot = robot_of(3)
    for routing in ("ideal", "chord"):
        physics = MujocoPhysics(robot, 1, 1e-3, sim_dt_s=1e-4, routing=routing)
        command = JointVector.from_clarke(np.array([[[0.005, 0.0]]]))
        for _ in range(30):
            physics.step(command)
        before, rate = physics.state.displacement, physics.velocity
        physics.step(command)
        slope = (physics.state.displacement - before) / 1e-3
        np.testing.assert_allclose(physics.velocity / 2 + rate / 2, slope, atol=1e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"profile": "slow"}, "profile must be one of"),
        ({"routing": "curved"}, "routing must be one of"),
        ({"actuation": "pressure"}, "actuation must be one of"),
        ({"payload_kg": math.nan}, "payload_kg must be finite"),
        ({"payload_kg": -1.0}, "payload_kg must be finite"),
        ({"sim_dt_s": 0.003}, "must divide the control period"),
        ({"sim_dt_s": 0.0}, "sim_dt_s must be a positive"),
        ({"threads": 0}, "threads must be"),
        ({"gravity_m_s2": (0.0, math.inf, 0.0)}, "gravity_m_s2 must hold 3 finite"),
        ({"base_quaternion": (1.0, 1.0, 0.0, 0.0)}, "base_quaternion must have length 1"),
        ({"base_position_m": (0.0, np.inf, 0.0)}, "base_position_m must hold 3 finite numbers"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_bad_options_are_refused_by_name(options, message):
    with pytest.raises(ValueError, match=message):
        MujocoPhysics(robot_of(3), 1, CONTROL_DT, **options)


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        ({"n_disks": 300}, "disks overlap"),
        ({"backbone_diameter_m": 0.0}, "backbone_diameter_m must be a positive"),
        ({"n_tendons": 2}, "n_tendons must be at least 3"),
        ({"joint_type": "chain"}, "joint_type must be one of"),
        ({"pretension_n": -1.0}, "pretension_n must be finite"),
        ({"tendon_stiffness_n_m": math.nan}, "tendon_stiffness_n_m must be a positive"),
    ],
    ids=lambda value: str(value) if isinstance(value, dict) else "",
)
def test_impossible_segments_are_refused_by_name(segment, message):
    with pytest.raises(ValueError, match=message):
        Segment(**segment)


def test_unknown_material_is_refused_and_known_ones_apply():
    assert make_robot(material="tpu").segments[0].density_kg_m3 == MATERIALS["tpu"].density_kg_m3
    with pytest.raises(ValueError, match="material must be one of"):
        make_robot(material="unobtainium")
