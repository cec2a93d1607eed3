"""The same problem under every representation: limits act on decoded commands, alike for all."""

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clarke_gym.envs.limits import CommandLimits
from clarke_gym.numerics.batch import Many
from clarke_gym.representations import make_representation, representation_names
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.robots.presets import make_robot

ID = "clarke_gym/Reach-v0"
DT = 0.05


def start(robot, rows=1):
    return JointVector.from_clarke(np.zeros((rows, robot.n_segments, 2)))


@pytest.mark.parametrize("control", ["increment", "absolute"])
@pytest.mark.parametrize("segments", [1, 3])
@settings(max_examples=25)
@given(n=st.integers(3, 12), seed=st.integers(0, 10_000), size=st.floats(0.0, 30.0))
def test_no_command_leaves_the_limits(control, segments, n, seed, size):
    robot = make_robot(n_tendons=n, n_segments=segments)
    limits = CommandLimits(robot, control, DT)
    rng = np.random.default_rng(seed)
    command = start(robot, 4)
    for _ in range(40):
        previous = command
        action = rng.uniform(-size, size, (4, robot.n_joints))
        command = limits.apply(Splitter(robot, Many(len(action))).rows(action), command)
        bends = np.diff(
            command.clarke / robot.pitch_radii[:, None], axis=1, prepend=np.zeros((4, 1, 2))
        )
        assert (np.linalg.norm(bends, axis=2) <= robot.max_bending + 1e-12).all()
        step = np.linalg.norm(command.clarke - previous.clarke, axis=2)
        if segments == 1:  # a proximal limit may move the distal tendons' sum
            assert (step <= robot.tendon_speeds * DT + 1e-15).all()
        if command.off_manifold is not None:
            assert np.abs(command.off_manifold).max() <= robot.max_cocontraction_m + 1e-15
            onto = (robot.decoder @ robot.encoder) @ command.off_manifold
            np.testing.assert_allclose(onto, 0.0, atol=1e-15)


@pytest.mark.parametrize("n", [3, 4, 7, 11])
def test_corners_of_square_and_cube_mean_the_same_as_the_rim_of_the_disk(n):
    robot = make_robot(n_tendons=n)
    limits = CommandLimits(robot, "increment", DT)
    for name in representation_names():
        if name == "antagonistic" and n != 4:
            continue
        representation = make_representation(name, robot)
        corner = np.ones((1, representation.size))
        joints = representation.decode(corner)
        reach = np.linalg.norm(joints @ robot.encoder.T)
        moved = np.linalg.norm(
            limits.apply(Splitter(robot, Many(1)).rows(joints), start(robot)).clarke
        )
        expected = robot.max_tendon_speed_m_s * DT * min(reach, 1.0)
        assert moved == pytest.approx(expected, abs=1e-15)


def test_off_manifold_part_does_not_change_the_shape_and_is_reported():
    env = gym.make(ID, n_tendons=4)
    quiet, loud = [], []
    for trace, common in ((quiet, 0.0), (loud, 0.5)):
        env.reset(seed=1)
        for _ in range(10):
            action = np.array([0.4, -0.1, -0.4, 0.1]) + common
            _, reward, _, _, info = env.step(action)
            trace.append((reward, info["off_manifold_m"]))
    np.testing.assert_allclose([r for r, _ in quiet], [r for r, _ in loud], atol=1e-6)
    assert quiet[-1][1] == 0.0
    assert loud[-1][1] == pytest.approx(env.unwrapped.robot.max_cocontraction_m)


@pytest.mark.parametrize("control", ["increment", "absolute"])
@pytest.mark.parametrize("segments", [1, 2])
@pytest.mark.parametrize("n", [3, 4, 7])
def test_one_command_sequence_gives_the_same_rewards_under_every_representation(
    control, segments, n, representations_for
):
    """The protocol's rule 1. The sequence lies in every representation's box."""
    keywords = {"n_tendons": n, "n_segments": segments, "control": control}
    robot = make_robot(n_tendons=n, n_segments=segments)
    rng = np.random.default_rng(n)
    clarke = rng.uniform(-0.2, 0.2, (30, 2 * segments)) + 0.05
    joints = clarke @ robot.decoder.T
    reference = None
    for name in representations_for(n):
        env = gym.make(ID, representation=name, disable_env_checker=True, **keywords)
        env.reset(seed=5)
        coded = make_representation(name, robot).encode(joints)
        results = []
        for action in coded:
            _, reward, _, _, info = env.step(action)
            results.append([reward, info["tip_error_m"], info["is_success"]])
        reference = reference or results
        np.testing.assert_allclose(results, reference, atol=1e-6)


def test_polar_and_clarke_name_the_same_action():
    robot = make_robot(n_tendons=5)
    polar, clarke = (make_representation(name, robot) for name in ("arc_polar", "clarke"))
    joints = polar.decode(np.array([0.0, 0.5]))  # half magnitude, a quarter turn
    np.testing.assert_allclose(clarke.encode(joints), [0.0, 0.5], atol=1e-15)


def test_distal_tendons_move_when_the_proximal_segment_bends():
    """Pulling only proximal tendons unbends the distal segment: its tendons are held, not slack."""
    robot = make_robot(n_tendons=3, n_segments=2)
    env = gym.make(ID, n_tendons=3, n_segments=2, random_start=False)
    env.reset(seed=0)
    action = np.concatenate([robot.segments[0].matrices[1] @ [1.0, 0.0], np.zeros(3)])
    for _ in range(8):
        env.step(action)
    command = env.unwrapped._core._command.clarke[0]
    assert command[0, 0] == pytest.approx(0.008)
    assert command[1, 0] == pytest.approx(0.0, abs=1e-15)
    tip = env.unwrapped.physics.state.tip_quaternion[0]
    np.testing.assert_allclose(tip[1:3], 0.0, atol=1e-12)  # the tip keeps its direction


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_all_segments_cross_their_range_in_the_same_time(segments):
    """Absolute targets at the limits, all in one plane: everybody arrives in the same step."""
    robot = make_robot(n_tendons=3, n_segments=segments)
    limits = CommandLimits(robot, "absolute", DT)
    action = np.tile([1.0, 0.0], segments)[None] @ robot.decoder.T
    command, steps = start(robot), 0
    while steps < 100 and not np.allclose(command.clarke[0, :, 0], robot.max_clarke):
        command = limits.apply(Splitter(robot, Many(len(action))).rows(action), command)
        steps += 1
    expected = robot.segments[0].max_clarke_m / (robot.max_tendon_speed_m_s * DT)
    assert steps == int(np.ceil(expected))
