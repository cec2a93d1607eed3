"""Representations: inverse laws, bounds, and the relations that make them controls."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clarke_gym import kinematics
from clarke_gym.representations.instruments import INSTRUMENTS
from clarke_gym.representations.registry import (
    RANDOM_BASIS_CONDITION,
    make_representation,
    representation_names,
)
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.presets import make_robot


def names_for(n):
    return [name for name in representation_names() if n == 4 or name != "antagonistic"]


CASES = [(name, n, s) for n in (3, 4, 7, 32) for s in (1, 3) for name in names_for(n)]


@pytest.mark.parametrize(("name", "n", "segments"), CASES)
def test_encode_undoes_decode(name, n, segments):
    representation = make_representation(name, make_robot(n_tendons=n, n_segments=segments))
    z = np.random.default_rng(0).uniform(-0.9, 0.9, (20, representation.size))
    joints = representation.decode(z)
    assert joints.shape == (20, n * segments)
    if name in ("projected", "clarke_nuisance"):  # n numbers for two degrees of freedom
        again = representation.decode(representation.encode(joints))
        np.testing.assert_allclose(again, joints, atol=1e-14)
    else:
        np.testing.assert_allclose(representation.encode(joints), z, atol=1e-12)


@pytest.mark.parametrize("name", names_for(4))
def test_whole_numbers_are_numbers(name):
    representation = make_representation(name, make_robot(n_tendons=4))
    for method, size in ((representation.decode, representation.size), (representation.encode, 4)):
        whole = np.array([[1] + [0] * (size - 1)])
        np.testing.assert_array_equal(method(whole), method(whole.astype(float)))


@pytest.mark.parametrize(("name", "n", "segments"), CASES)
def test_everything_but_raw_and_common_modes_stays_on_the_manifold(name, n, segments):
    robot = make_robot(n_tendons=n, n_segments=segments)
    representation = make_representation(name, robot)
    joints = representation.decode(
        np.random.default_rng(1).uniform(-1, 1, (9, representation.size))
    )
    off = joints - joints @ (robot.decoder @ robot.encoder).T
    if name in ("raw", "raw_scaled", "modal", "clarke_common"):
        assert np.abs(off).max() > 0.05
    else:
        np.testing.assert_allclose(off, 0.0, atol=1e-12)


@pytest.mark.parametrize(("name", "n", "segments"), CASES)
def test_bounds_hold_over_joint_space_and_are_reached_within_a_factor(name, n, segments):
    robot = make_robot(n_tendons=n, n_segments=segments)
    representation = make_representation(name, robot)
    off_limit = np.full(robot.n_joints, 0.05)
    bound = representation.encoded_bound(robot, 1.0, off_limit)
    rng = np.random.default_rng(2)
    angle = rng.uniform(-np.pi, np.pi, (4000, segments))
    disk = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(4000, -1)
    residual = rng.uniform(-1, 1, (4000, robot.n_joints))
    residual[0] = 1.0  # the common mode
    residual -= residual @ (robot.decoder @ robot.encoder).T
    residual *= 0.05 / np.abs(residual).max(axis=1, keepdims=True)
    coded = np.abs(representation.encode(disk @ robot.decoder.T + residual)).max(axis=0)
    assert (coded <= bound + 1e-12).all()
    if name not in INSTRUMENTS:  # modes that hardly any command of this kind shows
        assert (coded > 0.7 * bound).all()


def test_isotropic_noise_moves_the_tip_alike_in_raw_scaled_and_clarke():
    rng = np.random.default_rng(3)
    for n in (3, 7, 11):
        robot = make_robot(n_tendons=n)
        spreads = []
        for name in ("clarke", "raw_scaled", "raw"):
            representation = make_representation(name, robot)
            noise = rng.normal(size=(40_000, representation.size))
            spreads.append((representation.decode(noise) @ robot.encoder.T).std())
        np.testing.assert_allclose(spreads[:2], 1.0, rtol=0.02)
        np.testing.assert_allclose(spreads[2], np.sqrt(2 / n), rtol=0.02)


def test_antagonistic_pairs_are_clarke_coordinates_of_four_tendons():
    robot = make_robot(n_tendons=4)
    pairs, clarke = (make_representation(name, robot) for name in ("antagonistic", "clarke"))
    np.testing.assert_allclose(pairs.decoder, clarke.decoder, atol=1e-15)


def test_random_basis_has_the_stated_condition_number():
    robot = make_robot(n_tendons=7)
    basis = robot.encoder @ make_representation("random_basis", robot).decoder
    assert np.linalg.cond(basis) == pytest.approx(RANDOM_BASIS_CONDITION)


@given(st.integers(3, 32))
def test_two_tendon_coordinates_are_displacements_of_two_tendons(n):
    robot = make_robot(n_tendons=n)
    representation = make_representation("two_tendon", robot)
    joints = representation.decode(np.array([0.3, -0.2]))
    assert joints[0] == pytest.approx(0.3)
    assert np.isclose(joints, -0.2).any()
    assert np.linalg.cond(robot.encoder @ representation.decoder) < 2.0


def test_polar_is_singular_when_straight():
    representation = make_representation("arc_polar", make_robot())
    straight = representation.decode(np.array([[-1.0, 0.2], [-1.0, -0.9]]))
    np.testing.assert_allclose(straight, 0.0, atol=1e-16)


@pytest.mark.parametrize("name", names_for(7))
def test_unusual_layouts_work_too(name):
    rng = np.random.default_rng(4)
    angles = tuple(np.sort(rng.uniform(0, 2 * np.pi, 7)))
    robot = Robot((Segment(n_tendons=7, tendon_angles_rad=angles),))
    representation = make_representation(name, robot)
    z = rng.uniform(-0.9, 0.9, (5, representation.size))
    if name not in ("projected", "clarke_nuisance"):
        np.testing.assert_allclose(representation.encode(representation.decode(z)), z, atol=1e-10)


def test_unknown_and_impossible_representations_are_refused():
    with pytest.raises(ValueError, match=r"representation must be one of \['raw'.*got 'polar'"):
        make_representation("polar", make_robot())
    with pytest.raises(ValueError, match="needs n_tendons=4"):
        make_representation("antagonistic", make_robot(n_tendons=5))
    with pytest.raises(ValueError, match="last axis of 2"):
        make_representation("clarke", make_robot()).decode(np.zeros(3))


@pytest.mark.parametrize("n", [3, 4, 7, 11, 64])
def test_modal_is_raw_turned_so_that_two_axes_span_the_manifold(n):
    robot = make_robot(n_tendons=n)
    modal = make_representation("modal", robot)
    np.testing.assert_allclose(modal.decoder.T @ modal.decoder, np.eye(n), atol=1e-12)
    onto = robot.encoder @ modal.decoder
    np.testing.assert_allclose(onto[:, :2], np.sqrt(2.0 / n) * np.eye(2), atol=1e-12)
    np.testing.assert_allclose(onto[:, 2:], 0.0, atol=1e-12)


def test_modal_axes_are_fourier_modes():
    angles = 2 * np.pi * np.arange(8) / 8
    modal = make_representation("modal", make_robot(n_tendons=8)).decoder
    np.testing.assert_allclose(modal[:, 2], 1 / np.sqrt(8), atol=1e-12)
    np.testing.assert_allclose(modal[:, 3], np.cos(2 * angles) / 2, atol=1e-12)


def test_numbers_without_effect_belong_to_their_segment():
    robot = make_robot(n_tendons=5, n_segments=2)
    nuisance = make_representation("clarke_nuisance", robot)
    assert nuisance.counts == (5, 5)
    assert nuisance.labels[5] == "2.1"
    plain = make_representation("clarke", robot)
    z = np.arange(10.0)
    np.testing.assert_array_equal(nuisance.decode(z), plain.decode(z[[0, 1, 5, 6]]))


def test_own_bends_are_those_of_the_coupled_kinematics():
    long, short = Segment(n_tendons=4, max_bending_rad=0.5), Segment(pitch_radius_m=0.004)
    robot = Robot((long, short, Segment(n_tendons=5)))
    bends = np.random.default_rng(0).uniform(-1, 1, (7, 3, 2))
    joints = make_representation("clarke_bends", robot).decode(bends.reshape(7, 6))
    expected = kinematics.bending_to_clarke(bends * robot.max_bending[:, None], robot.pitch_radii)
    found = (joints * robot.joint_scale) @ robot.encoder.T
    np.testing.assert_allclose(found.reshape(7, 3, 2), expected, atol=1e-15)


def test_own_bends_of_one_segment_are_clarke_coordinates():
    robot = make_robot(n_tendons=5)
    bends, clarke = (make_representation(name, robot) for name in ("clarke_bends", "clarke"))
    np.testing.assert_array_equal(bends.decoder, clarke.decoder)


def test_two_tendons_are_those_closest_to_a_right_angle():
    third = np.pi / 3.0
    segment = Segment(tendon_angles_rad=(0.0, third, third + 0.5 * np.pi))
    decoder = make_representation("two_tendon", Robot((segment,))).decoder
    np.testing.assert_allclose(decoder[1:], np.eye(2), rtol=0, atol=1e-12)
