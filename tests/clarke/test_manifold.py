"""Sampling, limits, trajectories and tension distribution on the manifold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.stats import kstest

from clarke_gym import clarke, kinematics
from clarke_gym.clarke import manifold, sampling, tension
from clarke_gym.clarke.layouts import Layout
from clarke_gym.clarke.trajectories import Trajectory, shortest_duration

N, SEED = st.integers(3, 64), st.integers(0, 2**31)


# --- sampling -----------------------------------------------------------------------------------


def test_disk_samples_are_uniform_in_area_and_always_feasible():
    rho_bar = sampling.sample_disk(np.random.default_rng(0).random((20_000, 2)), 0.01)
    radius = np.linalg.norm(rho_bar, axis=1)
    assert kstest((radius / 0.01) ** 2, "uniform").pvalue > 0.01
    assert kstest(np.arctan2(*rho_bar.T) / (2 * np.pi) + 0.5, "uniform").pvalue > 0.01
    assert kstest(rho_bar[:, 0] / 0.01, lambda x: _semicircle(x)).pvalue > 0.01
    assert (np.abs(clarke.from_clarke(rho_bar, 7)) <= 0.01 + 1e-15).all()


def _semicircle(x):
    x = np.clip(x, -1.0, 1.0)
    return 0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi


def test_shaped_and_tip_samples_follow_their_distributions():
    uniforms = np.random.default_rng(1).random((20_000, 2))
    shaped = np.linalg.norm(sampling.sample_shaped(uniforms, 2.0, lambda u: u**2), axis=1)
    assert kstest(np.sqrt(shaped / 2.0), "uniform").pvalue > 0.01
    tips, _ = kinematics.segment_pose(kinematics.sample_tips(uniforms, 1.5, 0.01) / 0.01, 1.0)
    angle = np.arctan2(tips[:, 1], tips[:, 0])
    assert kstest(angle / (2 * np.pi) + 0.5, "uniform").pvalue > 0.01


# --- limits -------------------------------------------------------------------------------------


@given(N, st.floats(1e-3, 10.0))
def test_the_polygon_is_the_exact_image_of_the_joint_box(n, limit):
    corners = manifold.limit_polygon(n, limit)
    assert len(corners) == manifold.polygon_corners(n)
    np.testing.assert_allclose(manifold.largest_joint(corners, n), limit, rtol=1e-12)
    middles = (corners + np.roll(corners, 1, axis=0)) / 2
    np.testing.assert_allclose(manifold.largest_joint(middles, n), limit, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(middles, axis=1), limit, rtol=1e-12)
    ratio = np.linalg.norm(corners, axis=1) / limit
    np.testing.assert_allclose(ratio, manifold.circumradius_ratio(n), rtol=1e-12)


@pytest.mark.parametrize("n", [3, 4, 5, 6, 7])
def test_the_polygon_equals_a_hull_of_feasible_points(n):
    points = np.random.default_rng(n).uniform(-1.5, 1.5, (20_000, 2))
    feasible = points[(np.abs(clarke.from_clarke(points, n)) <= 1.0).all(axis=1)]
    m = manifold.polygon_corners(n)
    area = m * np.tan(np.pi / m)
    assert area * 0.97 < ConvexHull(feasible).volume <= area


@given(N, SEED)
def test_saturation_keeps_limits_and_directions_and_does_not_touch_the_inside(n, seed):
    rho_bar = np.random.default_rng(seed).normal(size=(20, 2)) * 2
    for saturated, size in (
        (manifold.saturate_circle(rho_bar, 1.0), lambda x: np.linalg.norm(x, axis=1)),
        (manifold.saturate_polygon(rho_bar, n, 1.0), lambda x: manifold.largest_joint(x, n)),
    ):
        assert (size(saturated) <= 1.0 + 1e-12).all()
        inside = size(rho_bar) <= 1.0
        np.testing.assert_array_equal(saturated[inside], rho_bar[inside])
        np.testing.assert_allclose(size(saturated)[~inside], 1.0, rtol=1e-12)
        cross = saturated[:, 0] * rho_bar[:, 1] - saturated[:, 1] * rho_bar[:, 0]
        np.testing.assert_allclose(cross, 0.0, rtol=0, atol=1e-12)
    assert (
        np.abs(clarke.from_clarke(manifold.saturate_circle(rho_bar, 1.0), n)) <= 1 + 1e-12
    ).all()


@given(N, SEED)
def test_limits_map_to_the_manifold_and_back(n, seed):
    rng = np.random.default_rng(seed)
    layout = Layout(clarke.joint_angles(n), rng.uniform(0.005, 0.02, n))
    limits = rng.uniform(0.005, 0.02, n)
    radius = manifold.manifold_limit(limits, layout)
    assert (manifold.joint_limits(radius, layout) <= limits * (1 + 1e-12)).all()
    assert np.isclose(manifold.joint_limits(radius, layout), limits).any()
    angle = rng.uniform(0, 2 * np.pi, 50)
    rim = radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    assert (np.abs(layout.from_clarke(rim)) <= limits * (1 + 1e-12)).all()


# --- trajectories -------------------------------------------------------------------------------

LIMIT = st.floats(0.01, 10.0)


@given(LIMIT, LIMIT, LIMIT, N, SEED)
def test_motions_keep_all_limits_use_one_of_them_up_and_end_where_they_should(v, a, j, n, seed):
    start, goal = np.random.default_rng(seed).normal(size=(2, 2)) * 0.05
    motion = Trajectory.between(start, goal, max_speed=v, max_acceleration=a, max_jerk=j)
    time = np.linspace(0.0, motion.duration, 4001)
    peaks = []
    for derivative, limit in (
        (motion.velocity(time), v),
        (motion.acceleration(time), a),
        (motion.jerk(time[1:-1]), j),
    ):
        assert (np.abs(clarke.from_clarke(derivative, n)) <= limit * (1 + 1e-6)).all()
        peaks.append(np.linalg.norm(derivative, axis=1).max() / limit)
    assert 0.99 < max(peaks) <= 1 + 1e-6
    np.testing.assert_allclose(motion.position(time[[0, -1]]), [start, goal], rtol=0, atol=1e-15)
    np.testing.assert_allclose(motion.velocity(time[[0, -1]]), 0.0, rtol=0, atol=1e-12)
    outside = motion.position(np.array([-1.0, 1e9]))
    np.testing.assert_allclose(outside, [start, goal], rtol=0, atol=1e-16)


def test_derivatives_are_derivatives():
    motion = Trajectory.between(np.zeros(2), np.array([0.02, -0.01]), max_jerk=1.0)
    time = np.linspace(0.1, 0.9, 50) * motion.duration
    h = 1e-5 * motion.duration
    for lower, upper in (
        (motion.position, motion.velocity),
        (motion.velocity, motion.acceleration),
        (motion.acceleration, motion.jerk),
    ):
        slope = (lower(time + h) - lower(time - h)) / (2 * h)
        np.testing.assert_allclose(upper(time), slope, rtol=1e-6, atol=1e-8)


def test_batches_of_several_segments_and_motions_of_no_distance():
    start, goal = np.zeros((3, 4)), np.array([[0.0, 0, 0, 0], [0.01, 0, 0.02, 0], [0, 0, 0, 1.0]])
    motion = Trajectory.between(start, goal, max_speed=0.1)
    np.testing.assert_allclose(motion.duration, 1.875 * np.array([0.0, 0.02, 1.0]) / 0.1)
    np.testing.assert_allclose(motion.position(motion.duration), goal)
    np.testing.assert_allclose(motion.velocity(motion.duration / 2)[1], [0.05, 0, 0.1, 0])
    assert shortest_duration(0.0, max_speed=1.0) == 0.0


def test_bad_limits_are_refused():
    with pytest.raises(ValueError, match="max_speed must be positive"):
        shortest_duration(1.0, max_speed=0.0)
    with pytest.raises(ValueError, match="at least one"):
        shortest_duration(1.0)
    with pytest.raises(ValueError, match="even last axes"):
        Trajectory.between(np.zeros(3), np.zeros(3), max_speed=1.0)
    with pytest.raises(ValueError, match="radius must be a positive finite"):
        sampling.sample_disk(np.zeros(2), 0.0)
    with pytest.raises(ValueError, match="smallest joint limit"):
        manifold.manifold_limit([0.0, 1.0, 1.0])


# --- tension ------------------------------------------------------------------------------------


@given(N, SEED, st.floats(0.0, 5.0))
def test_shifting_keeps_the_manifold_force_and_is_as_small_as_possible(n, seed, minimum):
    force = np.random.default_rng(seed).normal(size=(4, 2)) * 5
    tensions = tension.distribute(force, n, minimum)
    np.testing.assert_allclose(clarke.to_clarke(tensions), force, rtol=0, atol=1e-13)
    np.testing.assert_allclose(tensions.min(axis=1), minimum, rtol=0, atol=1e-13)
    fine = tensions + 1.0
    np.testing.assert_array_equal(tension.shift(fine, minimum), fine)


@given(N, SEED)
def test_clipping_is_non_negative_but_changes_the_force(n, seed):
    force = np.random.default_rng(seed).normal(size=2) * 5
    tensions = tension.distribute(force, n, method="clip")
    assert tensions.min() >= 0.0
    reached = clarke.to_clarke(tensions)
    assert np.linalg.norm(reached - force) > 0.3 * np.linalg.norm(force)
    with pytest.raises(ValueError, match="method"):
        tension.distribute(force, n, method="pull")


def test_torch_gradients_at_rest():
    torch = pytest.importorskip("torch")
    rest = torch.zeros(3, 2, dtype=torch.float64, requires_grad=True)
    outputs = [
        manifold.saturate_circle(rest, 1.0),
        manifold.saturate_polygon(rest, 5, 1.0),
        tension.distribute(rest, 5),
        tension.distribute(rest, 5, method="clip"),
        Trajectory.between(rest, rest.detach() + 0.01, max_speed=1.0).position(0.01),
        Trajectory.between(rest, rest.detach(), max_jerk=1.0).duration,
        sampling.sample_disk(0.5 + rest, 1.0),
    ]
    for output in outputs:
        (gradient,) = torch.autograd.grad(output.sum(), rest)
        assert torch.isfinite(gradient).all()
