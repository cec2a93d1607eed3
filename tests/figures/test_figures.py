"""The pictures show live data and the sheet's geometry; without matplotlib the error is clear."""

import sys

import numpy as np
import pytest

from clarke_gym import clarke, figures
from clarke_gym.figures.manifold import exploration_shares


def test_the_ellipse_has_the_semi_axes_of_the_sheet():
    bar, d = np.array([0.3, -0.4]), 1.2
    curve = figures.tilted_ellipse(bar, d, 100_001)
    radius = np.linalg.norm(curve, axis=1)
    np.testing.assert_allclose(radius.max(), np.sqrt(d**2 + bar @ bar), rtol=1e-8)
    np.testing.assert_allclose(radius.min(), d, rtol=1e-8)
    assert np.linalg.matrix_rank(curve, tol=1e-9) == 2
    top = curve[np.argmax(curve[:, 2]), :2]  # the largest displacement is at the angle alpha
    np.testing.assert_allclose(top / d, bar / 0.5, rtol=0, atol=1e-3)


def test_displacement_feet_lie_on_the_circle_over_the_clarke_vector():
    bar = np.array([0.004, 0.0025])
    axes = figures.draw_tendon_ring(bar, n=7)
    feet = np.asarray(axes.collections[1].get_offsets()) / 1e3
    np.testing.assert_allclose(
        np.linalg.norm(feet - bar / 2, axis=1), np.linalg.norm(bar) / 2, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        np.sum(feet * clarke.inverse_matrix(7), axis=1),
        clarke.from_clarke(bar, 7),
        rtol=0,
        atol=1e-12,
    )


def test_exploration_reaches_as_published_and_shrinks_with_the_number_of_tendons():
    means = [exploration_shares(n, 100_000)[0].mean() for n in (3, 4, 5, 7)]
    np.testing.assert_allclose(means, [0.607, 0.521, 0.466, 0.391], rtol=0, atol=0.003)
    off = [exploration_shares(n)[1].mean() for n in (3, 7, 11)]
    assert off == sorted(off)


@pytest.mark.parametrize("name", figures.FIGURES)
def test_figures_can_be_drawn_into_given_axes(name):
    from matplotlib.figure import Figure

    own = figures.FIGURES[name]()
    flat = not hasattr(own, "get_zlim")
    axes = Figure().add_subplot(projection=None if flat else "3d")
    assert figures.FIGURES[name](axes=axes) is axes


def test_all_are_saved_alike_every_time(tmp_path):
    first, second = (figures.save_all(tmp_path / name, dpi=30) for name in ("a", "b"))
    assert {path.stem for path in first} == set(figures.FIGURES)
    assert [a.read_bytes() for a in first] == [b.read_bytes() for b in second]


def test_without_matplotlib_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"clarke_gym\[figures\]"):
        figures.draw_tendon_ring()


def test_bad_numbers_are_refused():
    with pytest.raises(ValueError, match="pitch_radius"):
        figures.draw_tendon_ring(pitch_radius=0.0)
    with pytest.raises(ValueError, match="rho_bar"):
        figures.draw_virtual_displacement((0.0, 0.0))
