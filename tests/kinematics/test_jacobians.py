"""Jacobians against differences in 50 digits, at every scale of bending."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clarke_gym import kinematics
from clarke_gym.kinematics.jacobians import segment_jacobian, tip_jacobian

SIZES = [0.0, 1e-300, 1e-160, 1e-9, 1e-3, 0.5, 0.999, 1.001, 2.0, 3.2, 5.0, 6.28]
REAL = st.floats(-2.0, 2.0)


def pose_in_high_precision(x, y, length):
    """Position and quaternion of an arc from textbook formulas in mpmath numbers."""
    phi = mpmath.sqrt(x * x + y * y)
    if phi == 0:
        return [mpmath.mpf(0), mpmath.mpf(0), length, mpmath.mpf(1), mpmath.mpf(0), mpmath.mpf(0)]
    lateral = (1 - mpmath.cos(phi)) / phi**2
    h = mpmath.sin(phi / 2) / phi
    axial = length * mpmath.sin(phi) / phi
    return [length * x * lateral, length * y * lateral, axial, mpmath.cos(phi / 2), -y * h, x * h]


@pytest.mark.parametrize("phi", SIZES)
@pytest.mark.parametrize("theta", [0.0, 0.4, 2.2, -1.9])
def test_segment_jacobian_equals_differences_in_high_precision(phi, theta):
    bending, length = phi * np.array([np.cos(theta), np.sin(theta)]), 0.2
    with mpmath.workdps(700 if phi < 1e-100 else 80):
        x, y = (mpmath.mpf(float(part)) for part in bending)
        step, long = mpmath.mpf(10) ** -20, mpmath.mpf(0.2)
        expected = np.zeros((6, 2))
        for axis, (dx, dy) in enumerate([(step, 0), (0, step)]):
            ahead = pose_in_high_precision(x + dx, y + dy, long)
            behind = pose_in_high_precision(x - dx, y - dy, long)
            expected[:, axis] = [
                float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)
            ]
    position, quaternion = segment_jacobian(bending, length)
    np.testing.assert_allclose(position, expected[:3], rtol=0, atol=1e-15)
    np.testing.assert_allclose(quaternion, [*expected[3:], [0.0, 0.0]], rtol=0, atol=4e-15)


@settings(max_examples=30)
@given(st.lists(st.tuples(REAL, REAL), min_size=1, max_size=5), st.integers(0, 2**31))
def test_tip_jacobian_is_the_twist_of_a_finite_motion(bends, seed):
    bending, lengths = np.array(bends), 0.1 + 0.05 * np.arange(len(bends))
    rate = np.random.default_rng(seed).normal(size=bending.shape)
    stretch = np.random.default_rng(seed + 1).normal(size=len(lengths)) * 0.05
    h = 1e-5
    ahead = kinematics.forward(bending + h * rate, lengths + h * stretch)
    behind = kinematics.forward(bending - h * rate, lengths - h * stretch)
    linear = (ahead[0] - behind[0]) / (2 * h)
    turns = [Rotation.from_quat(q, scalar_first=True) for q in (ahead[1], behind[1])]
    angular = (turns[0] * turns[1].inv()).as_rotvec() / (2 * h)
    jacobian = tip_jacobian(bending, lengths, extensible=True)
    twist = jacobian @ np.concatenate([rate.ravel(), stretch])
    np.testing.assert_allclose(twist, [*linear, *angular], rtol=0, atol=1e-8)
    np.testing.assert_array_equal(jacobian[:, : 2 * len(bends)], tip_jacobian(bending, lengths))


@given(REAL, REAL)
def test_one_segments_tip_jacobian_agrees_with_the_segment_jacobian(x, y):
    position, _ = segment_jacobian(np.array([x, y]), 0.3)
    np.testing.assert_allclose(
        tip_jacobian(np.array([[x, y]]), [0.3])[:3], position, rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("batch", [(), (4,), (2, 3)])
def test_batches_equal_rows(batch):
    bending = np.random.default_rng(0).normal(size=(*batch, 3, 2))
    jacobian = tip_jacobian(bending, [0.1, 0.2, 0.3])
    assert jacobian.shape == (*batch, 6, 6)
    for index in np.ndindex(*batch):
        np.testing.assert_array_equal(
            jacobian[index], tip_jacobian(bending[index], [0.1, 0.2, 0.3])
        )


def test_single_precision():
    bending = np.random.default_rng(1).normal(size=(50, 2, 2))
    single = tip_jacobian(bending.astype(np.float32), np.array([0.2, 0.3]))
    assert single.dtype == np.float32
    np.testing.assert_allclose(single, tip_jacobian(bending, [0.2, 0.3]), rtol=0, atol=2e-6)


def test_bad_shapes_are_refused():
    with pytest.raises(ValueError, match="last axis of 2"):
        segment_jacobian(np.zeros(3), 0.2)
    with pytest.raises(ValueError, match=r"\(\.\.\., 2, 2\)"):
        tip_jacobian(np.zeros((3, 2)), [0.1, 0.1])
