"""Published parametrisations: their definitions, and what makes them Clarke coordinates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clarke_gym import kinematics
from clarke_gym.clarke.parametrisations import PARAMETRISATIONS
from clarke_gym.representations import make_representation, representation_names
from clarke_gym.robots.presets import make_robot

REAL = st.floats(-3.0, 3.0)


@given(REAL, REAL, st.floats(0.002, 0.05))
def test_all_are_similar_to_clarke_and_invert(x, y, d):
    rho_bar = d * np.array([x, y])
    for entry in PARAMETRISATIONS.values():
        coordinates = entry.from_clarke(rho_bar, d)
        np.testing.assert_allclose(entry.to_clarke(coordinates, d), rho_bar, rtol=0, atol=1e-15)
        unit = 1.0 if entry.angular else d
        size = np.hypot(x, y) * unit
        np.testing.assert_allclose(np.linalg.norm(coordinates), size, rtol=0, atol=1e-14)
        np.testing.assert_allclose(entry.matrix @ entry.matrix.T, np.eye(2))
        assert entry.status.strip()


def test_della_santina_is_the_half_difference_of_opposite_fibres():
    d, length, beta = 0.02, 0.3, np.array([0.7, -0.4])
    psi = np.arange(4) * np.pi / 2
    fibres = length - d * (beta[0] * np.cos(psi) + beta[1] * np.sin(psi))
    expected = [(fibres[2] - fibres[0]) / 2, (fibres[3] - fibres[1]) / 2]
    found = PARAMETRISATIONS["della_santina_2020"].from_clarke(d * beta, d)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-15)


@given(REAL, REAL)
def test_allen_is_the_rotation_vector_of_the_end(x, y):
    _, quaternion = kinematics.segment_pose(np.array([x, y]), 0.2)
    turn = Rotation.from_quat(quaternion, scalar_first=True).as_rotvec()
    if np.hypot(x, y) < 3.1:
        found = PARAMETRISATIONS["allen_2020"].from_clarke(0.01 * np.array([x, y]), 0.01)
        np.testing.assert_allclose([*found, 0.0], turn, rtol=0, atol=1e-13)


@pytest.mark.parametrize("name", PARAMETRISATIONS)
def test_the_registry_holds_them_and_they_are_clarke_up_to_a_turn(name):
    assert name in representation_names()
    robot = make_robot(n_tendons=7, n_segments=2)
    clarke, published = (make_representation(n, robot) for n in ("clarke", name))
    joints = clarke.decode(np.random.default_rng(0).normal(size=(9, 4)))
    pairs = clarke.encode(joints).reshape(9, 2, 2) @ PARAMETRISATIONS[name].matrix.T
    np.testing.assert_allclose(published.encode(joints), pairs.reshape(9, 4), rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        published.decode(published.encode(joints)), joints, rtol=0, atol=1e-14
    )


def test_mistakes_are_named():
    entry = PARAMETRISATIONS["qu_2016"]
    with pytest.raises(ValueError, match="pitch_radius"):
        entry.from_clarke(np.zeros(2), 0.0)
    with pytest.raises(ValueError, match="last axis of 2"):
        entry.to_clarke(np.zeros(3), 0.01)
