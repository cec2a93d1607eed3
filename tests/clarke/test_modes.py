"""The real Fourier basis of a ring of joints, and the normalised displacement."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clarke_gym import clarke
from clarke_gym.clarke.modes import (
    from_modes,
    mode_basis,
    mode_energy,
    mode_matrix,
    mode_names,
    normalised,
    to_modes,
)

N, SEED = st.integers(3, 64), st.integers(0, 2**31)


@given(N)
def test_modes_are_a_basis_of_orthogonal_shapes(n):
    basis = mode_basis(n)
    assert len(mode_names(n)) == n == len(set(mode_names(n)))
    np.testing.assert_allclose(mode_matrix(n) @ basis, np.eye(n), rtol=0, atol=1e-14)
    gram = basis.T @ basis
    np.testing.assert_allclose(gram, np.diag(np.diag(gram)), rtol=0, atol=1e-13)


@given(N, SEED)
def test_amplitudes_are_the_real_fourier_transform(n, seed):
    rho = np.random.default_rng(seed).normal(size=(2, n))
    spectrum = np.fft.rfft(rho) / n
    amplitudes = dict(zip(mode_names(n), np.moveaxis(to_modes(rho), -1, 0), strict=True))
    np.testing.assert_allclose(amplitudes["common"], spectrum[:, 0].real, rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        amplitudes["clarke_im"], -2 * spectrum[:, 1].imag, rtol=0, atol=1e-14
    )
    for m in range(2, (n - 1) // 2 + 1):
        np.testing.assert_allclose(
            amplitudes[f"mode_{m}_re"], 2 * spectrum[:, m].real, rtol=0, atol=1e-13
        )
        np.testing.assert_allclose(
            amplitudes[f"mode_{m}_im"], -2 * spectrum[:, m].imag, rtol=0, atol=1e-13
        )
    if n % 2 == 0:
        np.testing.assert_allclose(
            amplitudes["alternating"], spectrum[:, -1].real, rtol=0, atol=1e-14
        )


@given(N, SEED)
def test_round_trip_the_clarke_rows_and_parseval(n, seed):
    rho = np.random.default_rng(seed).normal(size=(3, n))
    np.testing.assert_allclose(from_modes(to_modes(rho)), rho, rtol=0, atol=1e-13)
    np.testing.assert_allclose(to_modes(rho)[:, 1:3], clarke.to_clarke(rho), rtol=0, atol=1e-15)
    energy = mode_energy(rho)
    np.testing.assert_allclose(sum(energy.values()), (rho**2).sum(axis=1), rtol=1e-12)
    onto = (clarke.project(rho) ** 2).sum(axis=1)
    np.testing.assert_allclose(energy["clarke"], onto, rtol=1e-12)


@pytest.mark.parametrize(("n", "pairs"), [(7, 2), (11, 4)])
def test_seven_and_eleven_joints_have_two_and_four_pairs_off_the_manifold(n, pairs):
    names = mode_names(n)
    assert sum(name.startswith("mode_") for name in names) == 2 * pairs
    off = np.eye(n) - clarke.projector(n)
    assert np.linalg.matrix_rank(off, tol=1e-9) == n - 2 == 2 * pairs + 1


@given(N, SEED, st.floats(1e-6, 1e6))
def test_normalised_displacements_have_unit_length_and_the_same_direction(n, seed, scale):
    rho = np.random.default_rng(seed).normal(size=n) * scale
    unit = normalised(rho)
    np.testing.assert_allclose(np.linalg.norm(unit), 1.0, rtol=1e-14)
    np.testing.assert_allclose(unit * np.linalg.norm(rho), rho, rtol=1e-13)


def test_epsilon_keeps_rest_finite():
    np.testing.assert_array_equal(normalised(np.zeros(3), 1e-9), 0.0)
    with pytest.raises(ValueError, match="no direction"):
        normalised(np.zeros((2, 3)))
    with pytest.raises(ValueError, match="epsilon"):
        normalised(np.ones(3), -1.0)
    with pytest.raises(ValueError, match="at least 3"):
        to_modes(np.zeros(2))
