"""Arbitrary joint locations, other designs, extensible segments, pass-through joints."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from clarke_gym import clarke, kinematics
from clarke_gym.clarke.layouts import Layout, map_design
from clarke_gym.kinematics.extensible import robot_from_extensible, robot_to_extensible
from clarke_gym.robots import JOINT_TYPES as ROBOT_JOINT_TYPES
from clarke_gym.robots.joints import (
    JOINT_TYPES,
    displacement_to_stroke,
    joint_type,
    stroke_to_displacement,
)

N, SEED = st.integers(3, 64), st.integers(0, 2**31)


def random_layout(n, rng):
    layout = Layout(rng.uniform(0, 2 * np.pi, n), rng.uniform(0.004, 0.02, n))
    assume(np.linalg.cond(layout.extensible_decoder) < 1e3 * layout.extensible_decoder[0, 2])
    return layout


def displacements(layout, beta, shorter=0.0):
    """Return rho from its definition, joint by joint."""
    return np.stack(
        [
            shorter + d * (beta[..., 0] * np.cos(psi) + beta[..., 1] * np.sin(psi))
            for psi, d in zip(layout.angles, layout.radii, strict=True)
        ],
        axis=-1,
    )


@given(N, SEED)
def test_any_layout_decodes_what_its_geometry_encodes(n, seed):
    rng = np.random.default_rng(seed)
    layout, beta = random_layout(n, rng), rng.normal(size=(3, 2, 2))
    rho = displacements(layout, beta)
    bar = layout.to_clarke(rho)
    np.testing.assert_allclose(bar, layout.pitch_radius * beta, rtol=0, atol=1e-14)
    np.testing.assert_allclose(layout.from_clarke(bar), rho, rtol=0, atol=1e-14)
    np.testing.assert_allclose(layout.project(rho), rho, rtol=0, atol=1e-14)


@given(N, SEED)
def test_least_squares_leaves_a_residual_orthogonal_to_the_manifold(n, seed):
    rng = np.random.default_rng(seed)
    layout, rho = random_layout(n, rng), rng.normal(size=n)
    np.testing.assert_allclose(
        (rho - layout.project(rho)) @ layout.decoder, 0.0, rtol=0, atol=1e-11
    )


@given(N, SEED)
def test_unequal_radii_on_symmetric_angles_agree_with_the_sheet_on_the_manifold(n, seed):
    rng = np.random.default_rng(seed)
    radii = rng.uniform(0.005, 0.02, n)
    layout, beta = Layout(clarke.joint_angles(n), radii), rng.normal(size=2)
    rho = displacements(layout, beta)
    np.testing.assert_allclose(clarke.to_clarke(rho / radii), beta, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        layout.to_clarke(rho) / layout.pitch_radius, beta, rtol=0, atol=1e-13
    )
    np.testing.assert_allclose((rho / radii).sum(), 0.0, rtol=0, atol=1e-12)  # Kirchhoff, weighted


def test_the_sheets_form_is_wrong_for_other_angles():
    layout, beta = Layout([0.1, 1.9, 4.0], 0.01), np.array([1.0, 0.0])
    wrong = clarke.to_clarke(displacements(layout, beta) / 0.01)
    assert np.abs(wrong - beta).max() > 0.1


@given(N, N, SEED, st.floats(0.3, 3.0))
def test_designs_of_one_shape_map_onto_each_other(n, m, seed, ratio):
    rng = np.random.default_rng(seed)
    a, b, beta = random_layout(n, rng), random_layout(m, rng), rng.normal(size=(4, 2))
    mapped = map_design(displacements(a, beta), a, b, ratio)
    np.testing.assert_allclose(mapped, displacements(b, ratio * beta), rtol=0, atol=1e-12)
    back = map_design(mapped, b, a, 1.0 / ratio)
    np.testing.assert_allclose(back, displacements(a, beta), rtol=0, atol=1e-12)


@given(N, SEED)
def test_extensible_segments_show_their_length_in_the_common_mode(n, seed):
    rng = np.random.default_rng(seed)
    layout, beta = random_layout(n, rng), rng.normal(size=(5, 2))
    length = rng.uniform(0.1, 0.3, 5)
    rho = displacements(layout, beta, 0.2 - length)
    bar, found = layout.to_extensible(rho, 0.2)
    np.testing.assert_allclose(found, length, rtol=0, atol=1e-13)
    np.testing.assert_allclose(bar, layout.pitch_radius * beta, rtol=0, atol=1e-13)
    np.testing.assert_allclose(layout.from_extensible(bar, length, 0.2), rho, rtol=0, atol=1e-13)


@given(N)
def test_a_symmetric_ring_measures_length_by_the_mean(n):
    ring = Layout.symmetric(n, 0.01)
    rho = np.random.default_rng(n).normal(size=n)
    bar, length = ring.to_extensible(rho, 1.0)
    np.testing.assert_allclose(length, 1.0 - rho.mean(), rtol=0, atol=1e-14)
    np.testing.assert_allclose(bar, clarke.to_clarke(rho), rtol=0, atol=1e-14)


def test_extensible_displacements_are_the_geometry_of_offset_curves():
    ring, beta, length = Layout.symmetric(5, 0.012), np.array([0.9, -0.6]), 0.23
    s = np.linspace(0.0, 1.0, 20_001)[:, None]
    position, quaternion = kinematics.segment_pose(beta * s, length * s[:, 0])
    measured = []
    for psi in ring.angles:
        offset = 0.012 * np.array([np.cos(psi), np.sin(psi), 0.0])
        path = position + kinematics.rotate(quaternion, offset)
        measured.append(0.2 - np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    expected = ring.from_extensible(0.012 * beta, length, 0.2)
    np.testing.assert_allclose(measured, expected, rtol=0, atol=1e-9)


@given(st.integers(1, 4), SEED)
def test_extensible_segments_in_series_round_trip(count, seed):
    rng = np.random.default_rng(seed)
    layouts = [random_layout(int(rng.integers(3, 9)), rng) for _ in range(count)]
    bending, rest = rng.normal(size=(6, count, 2)), rng.uniform(0.1, 0.3, count)
    lengths = rest * rng.uniform(0.8, 1.2, (6, count))
    rho = robot_from_extensible(bending, lengths, layouts, rest)
    last = displacements(layouts[-1], bending.sum(axis=1), (rest - lengths).sum(axis=1))
    np.testing.assert_allclose(rho[:, -layouts[-1].n :], last, rtol=0, atol=1e-14)
    found = robot_to_extensible(rho, layouts, rest)
    np.testing.assert_allclose(found[0], bending, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found[1], lengths, rtol=0, atol=1e-12)


def test_lines_of_joints_are_refused():
    with pytest.raises(ValueError, match="collinear"):
        Layout([0.3, 0.3 + np.pi, 0.3], 0.01)
    psi = np.array([-0.5, 0.0, 0.5])
    line = Layout(psi, 0.01 / np.cos(psi))  # bends in every direction, but one straight line
    with pytest.raises(ValueError, match="cannot tell a change of length"):
        line.to_extensible(np.zeros(3), 0.2)
    with pytest.raises(ValueError, match="last axis of 3"):
        line.to_clarke(np.zeros(4))
    with pytest.raises(ValueError, match="last axis of 2"):
        line.from_clarke(np.zeros(3))
    with pytest.raises(ValueError, match="last axis of 6"):
        robot_to_extensible(np.zeros(5), [Layout.symmetric(3), Layout.symmetric(3)], [1.0, 1.0])
    with pytest.raises(ValueError, match="must end in"):
        robot_from_extensible(np.zeros((1, 2)), np.zeros(2), [Layout.symmetric(3)], [1.0])


def test_joint_types_differ_in_sign_and_in_what_they_carry():
    assert set(JOINT_TYPES) == set(ROBOT_JOINT_TYPES)
    stroke = np.array([1.0, -2.0, 1.0])
    np.testing.assert_array_equal(stroke_to_displacement(stroke, "tendon"), stroke)
    np.testing.assert_array_equal(stroke_to_displacement(stroke, "rod"), stroke)
    np.testing.assert_array_equal(stroke_to_displacement(stroke, "bellows"), -stroke)
    for name in JOINT_TYPES:
        back = displacement_to_stroke(stroke_to_displacement(stroke, name), name)
        np.testing.assert_array_equal(back, stroke)
    limits = {name: JOINT_TYPES[name].force_limits for name in JOINT_TYPES}
    inf = np.inf
    assert limits == {"tendon": (0.0, inf), "rod": (-inf, inf), "bellows": (-inf, 0.0)}
    with pytest.raises(ValueError, match="joint_type must be one of"):
        joint_type("string")
