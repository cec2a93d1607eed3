"""Constant-curvature kinematics against matrix exponentials, high precision and geometry."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation
from scipy.stats import kstest

from clarke_gym import kinematics
from clarke_gym.numerics.batch import One
from clarke_gym.physics.constant_curvature import ConstantCurvature
from clarke_gym.robots import Robot, Segment

ANGLES = [0.0, 1e-300, 1e-160, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 2.0, 3.0, 4.5, 6.0, 2 * np.pi]


def twist_pose(bending, length):
    """Pose of an arc from the exponential of its constant twist."""
    x, y = bending
    twist = np.zeros((4, 4))
    twist[:3, :3] = [[0, 0, x], [0, 0, y], [-x, -y, 0]]
    twist[2, 3] = length
    return expm(twist)


def rotation(quaternion):
    return Rotation.from_quat(np.roll(quaternion, -1)).as_matrix()


@pytest.mark.parametrize("phi", ANGLES)
@pytest.mark.parametrize("theta", [0.0, 0.7, 2.5, -1.2])
def test_segment_pose_equals_the_matrix_exponential(phi, theta):
    bending = phi * np.array([np.cos(theta), np.sin(theta)])
    position, quaternion = kinematics.segment_pose(bending, 0.2)
    expected = twist_pose(bending, 0.2)
    np.testing.assert_allclose(position, expected[:3, 3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotation(quaternion), expected[:3, :3], rtol=0, atol=1e-13)
    assert abs(np.linalg.norm(quaternion) - 1.0) < 1e-15


@pytest.mark.parametrize("phi", ANGLES)
def test_position_is_accurate_to_1e_14_relative(phi):
    """Against 60 digits: the naive (1 - cos phi) / phi^2 loses everything at 1e-8."""
    with mpmath.workdps(60):
        x = mpmath.mpf(phi)
        lateral = (1 - mpmath.cos(x)) / x if phi > 1e-25 else x / 2
        axial = mpmath.sin(x) / x if phi else mpmath.mpf(1)
        position, _ = kinematics.segment_pose(np.array([phi, 0.0]), 1.0)
        errors = [abs(position[0] - lateral), abs(position[2] - axial)]
        assert max(float(e) for e in errors) < 1e-15
        if 1e-150 < phi < 5.0:
            assert float(abs(position[0] / lateral - 1)) < 1e-14


@pytest.mark.parametrize("phi", ANGLES)
def test_single_precision(phi):
    bending = phi * np.array([np.cos(0.7), np.sin(0.7)])
    exact = kinematics.segment_pose(bending.astype(np.float32).astype(np.float64), 1.0)
    single = kinematics.segment_pose(bending.astype(np.float32), np.float64(1.0))
    for want, got in zip(exact, single, strict=True):
        assert got.dtype == np.float32
        np.testing.assert_allclose(got, want, rtol=0, atol=1e-6)


@given(st.floats(0.0, 2 * np.pi), st.floats(-3.2, 3.2), st.floats(0.01, 2.0))
def test_random_arcs_equal_the_matrix_exponential(phi, theta, length):
    bending = phi * np.array([np.cos(theta), np.sin(theta)])
    position, quaternion = kinematics.segment_pose(bending, length)
    expected = twist_pose(bending, length)
    np.testing.assert_allclose(position, expected[:3, 3], rtol=0, atol=1e-13)
    np.testing.assert_allclose(rotation(quaternion), expected[:3, :3], rtol=0, atol=1e-13)


def test_lengths_may_differ_from_row_to_row():
    rng = np.random.default_rng(0)
    bending, lengths = rng.normal(size=(5, 2, 2)), rng.uniform(0.1, 0.3, (5, 2))
    position, _ = kinematics.forward(bending, lengths)
    curve = kinematics.backbone(bending, lengths, 4)
    for row in range(5):
        expected, _ = kinematics.forward(bending[row], lengths[row])
        np.testing.assert_allclose(position[row], expected, rtol=0, atol=1e-16)
        np.testing.assert_allclose(
            curve[row], kinematics.backbone(bending[row], lengths[row], 4), rtol=0, atol=1e-16
        )


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_precision_is_kept_whatever_describes_the_robot(dtype):
    bending = np.full((3, 2, 2), 0.4, dtype)
    lengths, radii = np.array([0.2, 0.1]), np.array([0.01, 0.008])
    for array in (
        *kinematics.forward(bending, lengths),
        kinematics.backbone(bending, lengths),
        kinematics.bending_to_clarke(bending, radii),
        kinematics.clarke_to_bending(bending, radii),
    ):
        assert array.dtype == dtype


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=5))
def test_several_segments_compose(bends):
    bending = np.array(bends)
    lengths = 0.1 + 0.05 * np.arange(len(bends))
    position, quaternion = kinematics.forward(bending, lengths)
    expected = np.eye(4)
    for b, length in zip(bending, lengths, strict=True):
        expected = expected @ twist_pose(b, length)
    np.testing.assert_allclose(position, expected[:3, 3], rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotation(quaternion), expected[:3, :3], rtol=0, atol=1e-13)


@given(st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2)), min_size=1, max_size=5))
def test_coupling_round_trips_and_sums_bends(bends):
    bending, radii = np.array(bends), 0.004 + 0.001 * np.arange(len(bends))
    coupled = kinematics.bending_to_clarke(bending, radii)
    np.testing.assert_allclose(coupled[-1], radii[-1] * bending.sum(axis=0), rtol=0, atol=1e-16)
    np.testing.assert_allclose(
        kinematics.clarke_to_bending(coupled, radii), bending, rtol=0, atol=1e-14
    )


def test_coupled_displacement_equals_the_shortening_of_the_offset_curve():
    """Geometry: a tendon at radius d along two bent segments is shorter by rho."""
    bending = np.array([[0.8, -0.3], [-0.4, 0.9]])
    lengths, d, psi, points = [0.2, 0.15], 0.01, 1.1, 20_000
    length = 0.0
    base_position, base_rotation = np.zeros(3), np.eye(3)
    for beta, arc in zip(bending, lengths, strict=True):
        s = np.linspace(0.0, 1.0, points + 1)[:, None]
        position, quaternion = kinematics.segment_pose(beta * s, arc * s[:, 0])
        offset = kinematics.rotate(quaternion, np.array([d * np.cos(psi), d * np.sin(psi), 0.0]))
        path = base_position + (position + offset) @ base_rotation.T
        length += np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        base_position = base_position + base_rotation @ position[-1]
        base_rotation = base_rotation @ rotation(quaternion[-1])
    clarke = kinematics.bending_to_clarke(bending, np.array([d, d]))[1]
    rho = clarke @ [np.cos(psi), np.sin(psi)]
    np.testing.assert_allclose(sum(lengths) - length, rho, rtol=0, atol=1e-9)


def test_quaternions_act_like_rotations():
    first, second = Rotation.random(2, random_state=1).as_quat(scalar_first=True)
    product = kinematics.quaternion_multiply(first, second)
    vector = np.array([0.3, -0.2, 0.9])
    expected = rotation(first) @ rotation(second) @ vector
    np.testing.assert_allclose(kinematics.rotate(product, vector), expected, rtol=0, atol=1e-15)


def test_backbone_starts_at_the_base_passes_all_ends_and_has_the_length():
    bending = np.array([[0.8, -0.3], [-0.4, 0.9]])
    lengths = [0.2, 0.15]
    curve = kinematics.backbone(bending, lengths, points=400)
    ends, _ = kinematics.segment_ends(bending, lengths)
    np.testing.assert_array_equal(curve[0], 0.0)
    np.testing.assert_allclose(curve[[400, 800]], ends, rtol=0, atol=1e-15)
    arc = np.linalg.norm(np.diff(curve, axis=0), axis=1).sum()
    np.testing.assert_allclose(arc, 0.35, rtol=1e-6)


@pytest.mark.parametrize("phi", [0.1, np.pi / 2, np.pi])
def test_dome_density_equals_the_surface_element(phi):
    def tip(a, b):
        return kinematics.segment_pose(a * np.array([np.cos(b), np.sin(b)]), 1.0)[0]

    h = 1e-5
    area = np.cross(tip(phi + h, 0.3) - tip(phi - h, 0.3), tip(phi, 0.3 + h) - tip(phi, 0.3 - h))
    np.testing.assert_allclose(
        kinematics.dome_density(phi), np.linalg.norm(area) / (4 * h * h), rtol=1e-6
    )


def test_dome_samples_are_uniform_in_area():
    """Tips of a quarter-circle robot: by symmetry and by area, not by Clarke disk."""
    rng = np.random.default_rng(0)
    limit = np.pi / 2
    bending = kinematics.sample_dome(rng.random((20_000, 2)), limit)
    phi = np.linalg.norm(bending, axis=1)
    grid = np.linspace(0.0, limit, 20_001)
    cdf = np.concatenate([[0.0], np.cumsum(kinematics.dome_density((grid[1:] + grid[:-1]) / 2))])
    cdf /= cdf[-1]
    assert kstest(phi, lambda x: np.interp(x, grid, cdf)).pvalue > 0.01
    assert kstest(np.arctan2(*bending.T), "uniform", (-np.pi, 2 * np.pi)).pvalue > 0.01
    assert kstest(phi, lambda x: (x / limit) ** 2).pvalue < 1e-6  # not uniform on the disk
    assert phi.max() <= limit


@settings(max_examples=20)
@given(st.floats(0, 6.2), st.floats(-3, 3))
def test_float_batch_and_array_agree_bit_for_bit(phi, theta):
    x, y = phi * np.cos(theta), phi * np.sin(theta)
    scalar = kinematics.arc_pose(float(x), float(y), 0.2)
    rows = np.full((100, 2), 0.3)
    rows[57] = x, y
    position, quaternion = kinematics.segment_pose(rows, 0.2)
    assert [*position[57], *quaternion[57]] == [*scalar[0], *scalar[1]]


def test_bad_shapes_are_refused():
    with pytest.raises(ValueError, match="last axis of 2"):
        kinematics.segment_pose(np.zeros(3), 0.2)
    with pytest.raises(ValueError, match=r"\(\.\.\., 2, 2\)"):
        kinematics.forward(np.zeros((3, 2)), [0.1, 0.1])
    with pytest.raises(TypeError, match="real numbers"):
        kinematics.segment_pose(np.array(["a", "b"]), 0.2)


@pytest.mark.parametrize("segments", [1, 2, 3])
def test_a_robots_backbone_is_that_of_its_bends_for_one_and_for_many_to_the_bit(segments):
    robot = Robot((Segment(n_tendons=3),) * segments)
    rng = np.random.default_rng(segments)
    bending = rng.uniform(-1.0, 1.0, (5, segments, 2))
    clarke = kinematics.bending_to_clarke(bending, robot.pitch_radii)
    many = ConstantCurvature(robot, 5, 0.05)
    many.reset(np.arange(5), clarke)
    curves = many.backbone(4)
    np.testing.assert_allclose(
        curves, kinematics.backbone(bending, robot.lengths, 4), rtol=0, atol=1e-15
    )
    for row in range(5):
        one = ConstantCurvature(robot, One(), 0.05)
        one.reset(np.array([0]), clarke[row : row + 1])
        np.testing.assert_array_equal(one.backbone(4)[0], curves[row])
