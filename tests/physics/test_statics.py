"""Shapes from tension and from tendons straight between disks, by independent reasoning."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from clarke_gym import clarke, kinematics
from clarke_gym.physics.statics import (
    axial_stiffness,
    bending_from_disk_displacements,
    bending_stiffness,
    disk_displacements,
    displacement_from_tension,
    shape_from_tension,
    taut_gain,
)
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.presets import PRESETS, make_robot

SEED = st.integers(0, 2**31)


@given(st.integers(3, 64), SEED)
def test_one_symmetric_segment_is_the_clarke_transform_of_tension(n, seed):
    robot = make_robot(n_tendons=n)
    segment = robot.segments[0]
    tension = np.random.default_rng(seed).uniform(0, 8, n)
    bending, lengths = shape_from_tension(tension, robot)
    gain = n * segment.pitch_radius_m / (2.0 * bending_stiffness(segment))
    expected = segment.length_m * gain * clarke.to_clarke(tension)
    np.testing.assert_allclose(bending[0], expected, rtol=0, atol=1e-12)
    strain = 1.0 - tension.sum() / axial_stiffness(segment)
    np.testing.assert_allclose(lengths, strain * segment.length_m, rtol=1e-14)


@pytest.mark.parametrize("name", ["two_segment", "two_segment_4", "slim"])
def test_segments_in_series_carry_the_tendons_that_pass(name):
    """The shape minimises bending plus axial energy minus the work of the tendons."""
    robot = PRESETS[name]
    tension = np.random.default_rng(1).uniform(0, 3, robot.n_joints)
    bending, lengths = shape_from_tension(tension, robot)

    def energy(x, scale=1e3):
        beta = x[: 2 * robot.n_segments].reshape(-1, 2)
        strain = x[2 * robot.n_segments :] / scale
        total = 0.0
        for k, segment in enumerate(robot.segments):
            total += 0.5 * bending_stiffness(segment) / segment.length_m * beta[k] @ beta[k]
            total += 0.5 * axial_stiffness(segment) * segment.length_m * strain[k] ** 2
        start = 0
        for j, segment in enumerate(robot.segments):
            for psi, d in zip(segment.angles, segment.radii, strict=True):
                direction = np.array([np.cos(psi), np.sin(psi)])
                rho = d * beta[: j + 1].sum(axis=0) @ direction
                rho -= (robot.lengths * strain)[: j + 1].sum()
                total -= tension[start] * rho
                start += 1
        return total

    solution = minimize(energy, np.zeros(3 * robot.n_segments), tol=1e-14).x
    found = np.concatenate([bending.ravel(), 1e3 * (lengths / robot.lengths - 1.0)])
    np.testing.assert_allclose(found, solution, rtol=0, atol=1e-5)


@given(SEED)
def test_displacements_from_tension_are_what_the_shape_shortens(seed):
    robot = PRESETS["two_segment_4"]
    tension = np.random.default_rng(seed).uniform(0, 3, robot.n_joints)
    bending, lengths = shape_from_tension(tension, robot)
    rho = displacement_from_tension(tension, robot)
    shorter = (robot.lengths - lengths)[None].cumsum(axis=1).repeat(4)
    onto = kinematics.bending_to_clarke(bending, robot.pitch_radii).ravel() @ robot.decoder.T
    np.testing.assert_allclose(rho, onto + shorter, rtol=0, atol=1e-15)


def polyline(robot, bending, k, psi):
    """Length of tendon k's path disk by disk, straight in between."""
    position, turn, length = np.zeros(3), np.array([1.0, 0, 0, 0]), 0.0
    offset = robot.segments[k].pitch_radius_m * np.array([np.cos(psi), np.sin(psi), 0.0])
    previous = position + kinematics.rotate(turn, offset)
    for segment, beta in zip(robot.segments[: k + 1], bending, strict=False):
        for _ in range(segment.n_disks):
            step, twist = kinematics.segment_pose(
                beta / segment.n_disks, segment.length_m / segment.n_disks
            )
            position = position + kinematics.rotate(turn, step)
            turn = kinematics.quaternion_multiply(turn, twist)
            hole = position + kinematics.rotate(turn, offset)
            length += np.linalg.norm(hole - previous)
            previous = hole
    return length


@given(SEED)
def test_disk_displacements_are_the_shortening_of_polylines_and_invert(seed):
    robot = PRESETS["slim"]
    bending = np.random.default_rng(seed).uniform(-1.5, 1.5, (2, 2))
    rho = disk_displacements(bending, robot)
    expected = [
        robot.lengths[: k + 1].sum() - polyline(robot, bending, k, psi)
        for k, segment in enumerate(robot.segments)
        for psi in segment.angles
    ]
    np.testing.assert_allclose(rho, expected, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        bending_from_disk_displacements(rho, robot), bending, rtol=0, atol=1e-12
    )


def test_the_chord_correction_vanishes_with_many_disks_and_at_rest():
    few, many = (Robot((Segment(n_disks=n, disk_thickness_m=1e-5),)) for n in (5, 2000))
    bending = np.array([[1.0, 0.4]])
    plain = few.decoder @ (0.01 * bending[0])
    assert np.abs(disk_displacements(bending, few) - plain).max() > 1e-4
    np.testing.assert_allclose(disk_displacements(bending, many), plain, rtol=0, atol=2e-8)
    np.testing.assert_array_equal(disk_displacements(np.zeros((1, 2)), few), 0.0)


def test_the_taut_gain_minimises_the_elastic_energy():
    segment = Segment(n_tendons=5, tendon_stiffness_n_m=3000.0)
    bar = np.array([0.008, -0.003])
    rho = clarke.from_clarke(bar, 5)
    directions = clarke.inverse_matrix(5)

    def energy(beta):
        stretch = rho - segment.pitch_radius_m * directions @ beta
        bend = bending_stiffness(segment) / segment.length_m * beta @ beta
        return 0.5 * bend + 0.5 * segment.tendon_stiffness_n_m * stretch @ stretch

    solution = minimize(energy, np.zeros(2), tol=1e-14).x
    expected = taut_gain(segment) * bar / segment.pitch_radius_m
    np.testing.assert_allclose(solution, expected, rtol=1e-5)
    assert 0.8 < taut_gain(segment) < 0.95


def test_impossible_displacements_are_refused():
    with pytest.raises(ValueError, match="half turn"):
        bending_from_disk_displacements(np.array([0.3, -0.15, -0.15]), Robot())
    with pytest.raises(ValueError, match="last axis of 3"):
        shape_from_tension(np.zeros(4), Robot())


@pytest.mark.parametrize("angles", [(0.0, 1.2, 3.0), (0.3, 2.0, 3.1, 5.0)])
def test_disk_displacements_are_inverted_where_tendons_are_not_spaced_evenly(angles):
    segment = Segment(n_tendons=len(angles), tendon_angles_rad=angles, n_disks=4)
    robot = Robot((segment, segment))
    bending = np.array([[1.0, 0.5], [-0.4, 0.8]])
    back = bending_from_disk_displacements(disk_displacements(bending, robot), robot)
    np.testing.assert_allclose(back, bending, rtol=0, atol=1e-9)


def test_tendons_on_one_line_keep_the_encoder_of_their_segment():
    """A common shortening cannot be told from a bend there, and is not taken for half of it."""
    turn, side = np.array([-0.5, 0.0, 0.5]), 0.01
    radii = np.hypot(side, side * np.tan(turn))
    segment = Segment(tendon_angles_rad=tuple(turn), tendon_radii_m=tuple(radii), n_disks=20)
    robot, bending = Robot((segment,)), np.array([[0.7, 0.3]])
    back = bending_from_disk_displacements(disk_displacements(bending, robot), robot)
    np.testing.assert_allclose(back, bending, rtol=0, atol=0.02)
