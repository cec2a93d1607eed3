"""Every line of the cheat sheet as a law, with the sheet's slips corrected."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clarke_gym import clarke

N = st.integers(3, 64)
REAL = st.floats(-1.0, 1.0, allow_nan=False, width=64)


def vectors(n, batch=()):
    return arrays(np.float64, (*batch, n), elements=REAL)


@given(N)
def test_matrices_follow_their_definition(n):
    psi = np.array([2 * np.pi * i / n for i in range(n)])
    expected = 2 / n * np.array([np.cos(psi), np.sin(psi)])
    np.testing.assert_allclose(clarke.transform_matrix(n), expected, rtol=0, atol=1e-15)
    np.testing.assert_allclose(clarke.joint_angles(n), psi, rtol=0, atol=1e-15)


@given(N)
def test_inverse_is_a_right_inverse_only(n):
    forward, inverse = clarke.transform_matrix(n), clarke.inverse_matrix(n)
    np.testing.assert_allclose(forward @ inverse, np.eye(2), rtol=0, atol=1e-15)
    assert np.abs(inverse @ forward - np.eye(n)).max() > 0.05


@given(N)
def test_transpose(n):
    np.testing.assert_allclose(
        clarke.transform_matrix(n).T, 2 / n * clarke.inverse_matrix(n), rtol=0, atol=1e-16
    )


@given(N, st.integers(1, 5))
def test_projector_is_toeplitz_idempotent_singular_and_symmetric(n, power):
    p = clarke.projector(n)
    i, j = np.indices((n, n))
    np.testing.assert_allclose(p, 2 / n * np.cos(2 * np.pi * (i - j) / n), rtol=0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.matrix_power(p, power), p, rtol=0, atol=1e-14)
    np.testing.assert_allclose(p, p.T, rtol=0, atol=1e-16)
    assert np.linalg.matrix_rank(p) == 2
    assert abs(np.linalg.det(p)) < 1e-12


@given(N)
def test_bias_vanishes(n):
    result = clarke.to_clarke(np.ones(n))
    assert result.shape == (2,)
    np.testing.assert_allclose(result, 0.0, rtol=0, atol=1e-15)


@given(N, st.data())
def test_mode_selection_has_the_factor_that_the_sheet_omits(n, data):
    k = data.draw(st.integers(1, n))
    one_hot = np.zeros(n)
    one_hot[k - 1] = 1.0
    angle = 2 * np.pi * (k - 1) / n
    expected = 2 / n * np.array([np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(clarke.to_clarke(one_hot), expected, rtol=0, atol=1e-15)


@given(N, st.data())
def test_linearity(n, data):
    a, b = data.draw(vectors(n)), data.draw(vectors(n))
    c, d = data.draw(vectors(2)), data.draw(vectors(2))
    np.testing.assert_allclose(
        clarke.to_clarke(a + b), clarke.to_clarke(a) + clarke.to_clarke(b), rtol=0, atol=1e-15
    )
    np.testing.assert_allclose(
        clarke.from_clarke(c + d, n),
        clarke.from_clarke(c, n) + clarke.from_clarke(d, n),
        rtol=0,
        atol=1e-15,
    )


@given(N, st.data())
def test_sum_of_squares_for_any_displacement(n, data):
    rho = data.draw(vectors(n))
    bar, m = clarke.to_clarke(rho), clarke.transform_matrix(n)
    np.testing.assert_allclose(bar @ bar, rho @ m.T @ m @ rho, rtol=0, atol=1e-14)


@given(N, st.data())
def test_scaled_magnitude_holds_on_the_manifold(n, data):
    bar = data.draw(vectors(2))
    rho = clarke.from_clarke(bar, n)
    np.testing.assert_allclose(bar @ bar, 2 / n * rho @ rho, rtol=0, atol=1e-14)


@given(N, st.floats(-10, 10))
def test_unit_circle(n, alpha):
    rho = clarke.from_clarke(np.array([np.cos(alpha), np.sin(alpha)]), n)
    np.testing.assert_allclose(rho, np.cos(clarke.joint_angles(n) - alpha), rtol=0, atol=1e-14)


@given(N)
def test_trigonometric_identities(n):
    s, c = np.sin(clarke.joint_angles(n)), np.cos(clarke.joint_angles(n))
    sums = [s.sum(), c.sum(), s @ c, s @ s - n / 2, c @ c - n / 2]
    np.testing.assert_allclose(sums, 0.0, rtol=0, atol=1e-13)


@given(N, st.data())
def test_projection_splits_orthogonally_and_satisfies_kirchhoff(n, data):
    rho = data.draw(vectors(n))
    onto = clarke.project(rho)
    np.testing.assert_allclose(onto @ (rho - onto), 0.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(onto.sum(), 0.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(clarke.to_clarke(rho - onto), 0.0, rtol=0, atol=1e-14)


@given(st.integers(4, 64))
def test_zero_sum_alone_does_not_define_the_manifold(n):
    rho = np.zeros(n)
    rho[[0, n // 2]] = 1.0, -1.0
    rho[1] += 1.0
    rho[-1] -= 1.0  # sums to zero, yet is not of the form Re cos + Im sin
    rho = rho if n > 4 else np.array([1.0, -1.0, 1.0, -1.0])
    assert abs(rho.sum()) < 1e-12
    assert np.abs(rho - clarke.project(rho)).max() > 1e-3


def test_zero_sum_defines_the_manifold_for_three_tendons():
    rho = np.array([0.3, -0.1, -0.2])
    np.testing.assert_allclose(clarke.project(rho), rho, rtol=0, atol=1e-16)


@given(N, st.data())
def test_batches_equal_rows(n, data):
    rho = data.draw(vectors(n, (3, 2)))
    batch = clarke.to_clarke(rho)
    assert batch.shape == (3, 2, 2)
    np.testing.assert_allclose(batch[1, 1], clarke.to_clarke(rho[1, 1]), rtol=0, atol=1e-15)


@given(
    st.lists(st.floats(0, 6.28), min_size=3, max_size=12, unique=True),
    arrays(np.float64, 2, elements=REAL),
    st.floats(0.002, 0.02),
    st.integers(0, 2**31),
)
def test_any_layout_round_trips(angles, beta, pitch, seed):
    directions = np.stack([np.cos(angles), np.sin(angles)])
    if np.linalg.cond(directions) > 1e4:
        return
    radii = np.random.default_rng(seed).uniform(0.5, 1.5, len(angles)) * pitch
    encoder, decoder = clarke.layout_matrices(angles, radii, pitch)
    rho = radii * (directions.T @ beta)  # the definition: d_i (beta . u_i)
    np.testing.assert_allclose(decoder @ (pitch * beta), rho, rtol=0, atol=1e-15)
    np.testing.assert_allclose(encoder @ rho, pitch * beta, rtol=0, atol=1e-9)


@pytest.mark.parametrize("bad", [2, 0, -3])
def test_too_few_tendons_are_refused(bad):
    with pytest.raises(ValueError, match="at least 3"):
        clarke.transform_matrix(bad)


@pytest.mark.parametrize("bad", [3.0, "3", True, None])
def test_counts_that_are_not_whole_numbers_are_refused(bad):
    with pytest.raises(TypeError, match="whole number"):
        clarke.transform_matrix(bad)


def test_bad_arrays_are_refused():
    with pytest.raises(ValueError, match="last axis of rho"):
        clarke.to_clarke([1.0, 2.0])
    with pytest.raises(ValueError, match="scalar"):
        clarke.to_clarke(1.0)
    with pytest.raises(ValueError, match="last axis of 2"):
        clarke.from_clarke([1.0, 2.0, 3.0], 3)
    with pytest.raises(TypeError, match="real numbers"):
        clarke.to_clarke([1j, 0, 0])
    with pytest.raises(ValueError, match="collinear"):
        clarke.layout_matrices([0.0, np.pi, 0.0], 0.01, 0.01)
    with pytest.raises(ValueError, match="radii"):
        clarke.layout_matrices([0.0, 1.0, 2.0], [0.01, -1.0, 0.01], 0.01)


def test_matrices_cannot_be_changed_by_accident():
    with pytest.raises(ValueError, match="read-only"):
        clarke.transform_matrix(5)[0, 0] = 1.0
