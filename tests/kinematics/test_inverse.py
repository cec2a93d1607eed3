"""Inverse kinematics: round trips, the nearest point, limits, unreachable goals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from clarke_gym import kinematics
from clarke_gym.kinematics.inverse import (
    bending_from_quaternion,
    segment_inverse,
    segment_inverse_extensible,
)
from clarke_gym.kinematics.inverse_chain import inverse_kinematics
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.kinematics.reachability import is_reachable, nearest_on_dome

ANGLE = st.one_of(st.floats(0.0, 6.2), st.sampled_from([0.0, 1e-300, 1e-160, 1e-9, 0.06, 0.07]))
THETA = st.floats(-3.1, 3.1)


def bend(phi, theta):
    return phi * np.array([np.cos(theta), np.sin(theta)])


@given(ANGLE, THETA, st.floats(0.01, 2.0))
def test_position_alone_gives_bending_and_length(phi, theta, length):
    bending = bend(phi, theta)
    position, _ = kinematics.segment_pose(bending, length)
    found, arc = segment_inverse_extensible(position)
    near_circle = 1.0 / max(0.02, 2.0 * np.pi - phi)  # the circle closes at 2 pi
    np.testing.assert_allclose(found, bending, rtol=0, atol=1e-14 * near_circle)
    np.testing.assert_allclose(arc, length, rtol=3e-14 * near_circle)


@given(ANGLE, THETA)
def test_fixed_length_and_quaternion_round_trip(phi, theta):
    bending = bend(phi, theta)
    position, quaternion = kinematics.segment_pose(bending, 0.2)
    found, residual = segment_inverse(position, 0.2)
    np.testing.assert_allclose(found, bending, rtol=0, atol=2e-13)
    assert abs(residual) < 1e-14
    np.testing.assert_allclose(bending_from_quaternion(quaternion), bending, rtol=0, atol=2e-13)


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-0.1, 0.3))
def test_residual_is_measured_along_the_ray(x, y, z):
    position = np.array([x, y, z])
    if np.hypot(x, y) < 1e-3:
        return
    bending, residual = segment_inverse(position, 0.2)
    reached, _ = kinematics.segment_pose(bending, 0.2)
    direction = position / np.linalg.norm(position)
    np.testing.assert_allclose(reached + residual * direction, position, rtol=0, atol=1e-13)


def test_nearest_point_of_the_dome_against_a_scalar_minimiser():
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.25, 0.25, (40, 3))
    bending, distance = nearest_on_dome(points, 0.2, 2.5)
    for point, best in zip(points, distance, strict=True):
        direction = point[:2] / np.linalg.norm(point[:2])

        def gap(phi, point=point, direction=direction):
            return np.linalg.norm(kinematics.segment_pose(phi * direction, 0.2)[0] - point)

        starts = np.linspace(0.0, 2.5, 41)
        k = int(np.argmin([gap(phi) for phi in starts]))
        bounds = (starts[max(k - 1, 0)], starts[min(k + 1, 40)])
        reference = minimize_scalar(gap, bounds=bounds, method="bounded")
        assert best <= reference.fun + 1e-15
    assert np.linalg.norm(bending, axis=1).max() <= 2.5 + 1e-12
    straight, left = nearest_on_dome(np.array([0.0, 0.0, 0.3]), 0.2)
    np.testing.assert_allclose([*straight, left], [0.0, 0.0, 0.1], rtol=0, atol=1e-15)


def test_reachability():
    inside, outside = kinematics.segment_pose(np.array([[1.0, 0.3], [1.6, 0.8]]), 0.2)[0]
    assert is_reachable(inside, 0.2, 1.5)
    assert not is_reachable(outside, 0.2, 1.5)
    assert not is_reachable(inside * 1.01, 0.2, 1.5)
    assert is_reachable(inside * 1.01, (0.2, 0.21), 1.5)
    assert not is_reachable(inside * 1.06, (0.2, 0.21), 1.5)
    assert not is_reachable(np.array([0.0, 0.0, -0.1]), (0.1, 0.5), 6.0)


@pytest.mark.parametrize("segments", [1, 2, 3, 4])
@pytest.mark.parametrize("limit", [np.pi / 2, 3.0])
def test_every_reachable_goal_is_found_within_the_limits(segments, limit):
    rng = np.random.default_rng(segments)
    lengths = 0.1 + 0.05 * rng.random(segments)
    bends = kinematics.sample_dome(rng.random((300, segments, 2)), limit)
    position, quaternion = kinematics.forward(bends, lengths)
    found, error = inverse_kinematics(position, lengths, max_bending=limit)
    assert error.max() < 1e-12
    assert np.linalg.norm(found, axis=-1).max() <= limit + 1e-12
    np.testing.assert_allclose(kinematics.forward(found, lengths)[0], position, rtol=0, atol=1e-12)
    if segments in (1, 3):
        found, error = inverse_kinematics(
            position, lengths, quaternion=quaternion, max_bending=limit, starts=30
        )
        assert np.mean(error < 1e-12) > 0.99


def test_a_good_start_is_kept_close():
    lengths, bending = [0.2, 0.2, 0.2], np.array([[0.5, 0.2], [-0.4, 0.6], [0.3, 0.3]])
    position, _ = kinematics.forward(bending, lengths)
    found, error = inverse_kinematics(position, lengths, start=bending + 1e-3)
    assert error < 1e-12
    assert np.abs(found - bending).max() < 5e-3


def test_unreachable_goals_come_back_with_the_least_error_found():
    goal = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -0.1], [0.3, 0.1, 0.2]])
    found, error = inverse_kinematics(goal, [0.2, 0.2], max_bending=1.0, starts=4)
    assert np.isfinite(found).all()
    np.testing.assert_allclose(error[0], 0.6 / 0.4, rtol=1e-3)
    assert (np.linalg.norm(found, axis=-1) <= 1.0 + 1e-12).all()


def test_batches_and_precision():
    goal = kinematics.forward(np.full((2, 3, 2, 2), 0.4), [0.2, 0.2])[0]
    bending, error = inverse_kinematics(goal.astype(np.float32), [0.2, 0.2])
    assert bending.shape == (2, 3, 2, 2)
    assert error.shape == (2, 3)
    assert bending.dtype == np.float32


def test_gradient_of_the_torch_solution_is_the_pseudo_inverse():
    torch = pytest.importorskip("torch")
    bending = np.array([[0.5, 0.2], [-0.4, 0.6]])
    goal = torch.tensor(kinematics.forward(bending, [0.2, 0.2])[0], requires_grad=True)
    found, error = inverse_kinematics(goal, [0.2, 0.2])
    assert float(error) < 1e-12
    found[0, 0].backward()
    jacobian = tip_jacobian(found.detach().numpy(), [0.2, 0.2])[:3]
    np.testing.assert_allclose(goal.grad, np.linalg.pinv(jacobian)[0], rtol=0, atol=1e-10)


def test_gradient_of_a_whole_pose_is_the_inverse_too():
    torch = pytest.importorskip("torch")
    lengths, bending = [0.1, 0.1, 0.1], [[0.3, 0.2], [0.5, -0.1], [-0.2, 0.4]]
    start = torch.tensor(bending, dtype=torch.float64)

    def there_and_back(bending):
        position, turn = kinematics.forward(bending, lengths)
        return inverse_kinematics(position, lengths, quaternion=turn, start=start.numpy())[0]

    jacobian = torch.autograd.functional.jacobian(there_and_back, start).reshape(6, 6)
    np.testing.assert_allclose(jacobian, np.eye(6), rtol=0, atol=1e-9)


def test_torch_searches_as_far_as_it_is_told():
    torch = pytest.importorskip("torch")
    goal, search = np.array([0.1, 0.05, 0.2]), {"starts": 1, "iterations": 1}
    search["quaternion"] = np.array([1.0, 0.0, 0.0, 0.0])
    left = [
        float(inverse_kinematics(each, [0.1] * 3, **search)[1])
        for each in (goal, torch.tensor(goal))
    ]
    assert left[0] == left[1] > 0.1


def test_bad_arguments_are_refused():
    with pytest.raises(ValueError, match="last axis of 3"):
        segment_inverse_extensible(np.zeros(2))
    with pytest.raises(ValueError, match="base axis"):
        segment_inverse_extensible(np.array([[0.1, 0.0, 0.1], [0.0, 0.0, -0.1]]))
    with pytest.raises(ValueError, match="last axis of 4"):
        bending_from_quaternion(np.zeros(3))
    with pytest.raises(ValueError, match="last axis of 3"):
        inverse_kinematics(np.zeros(2), [0.1])


def test_three_straight_segments_are_a_pose_like_any_other():
    """Their Jacobian has no full rank, and damping fades with the error."""
    position, upright = np.array([[0.0, 0.0, 0.3]]), np.array([[1.0, 0.0, 0.0, 0.0]])
    bending, error = inverse_kinematics(position, [0.1, 0.1, 0.1], quaternion=upright)
    assert error[0] < 1e-12
    assert np.abs(bending).max() < 1e-4
    other = np.array([[0.05, 0.02, 0.27]])
    alone = inverse_kinematics(other, [0.1, 0.1, 0.1], quaternion=upright)[0]
    both = np.concatenate([position, other]), np.concatenate([upright, upright])
    beside = inverse_kinematics(both[0], [0.1, 0.1, 0.1], quaternion=both[1])[0]
    np.testing.assert_array_equal(beside[1], alone[0])
