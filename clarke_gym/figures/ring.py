"""The cheat sheet's pictures, drawn from live data.

Every function draws into given matplotlib axes, or makes its own, and returns them. Matplotlib is
an extra: ``pip install clarke_gym[figures]``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym.clarke.transform import from_clarke, inverse_matrix, joint_angles
from clarke_gym.figures.canvas import BLUE, GREY, INK, MAGENTA, ORANGE, circle, new_axes, plane
from clarke_gym.figures.manifold import draw_exploration, draw_manifold_in_cube
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_last_axis, check_positive, check_tendon_count


def draw_tendon_ring(
    rho_bar: Any = (0.004, 0.0025), n: int = 5, pitch_radius: float = 0.01, axes: Any = None
) -> Any:
    r"""Draw the ring of joints, and the displacement circle that their displacements come from.

    The displacement of joint i is the projection of the Clarke coordinates on its direction; the
    points :math:`\rho_i u_i` lie on the circle whose diameter is the Clarke vector.

    Parameters
    ----------
    rho_bar : array_like, shape (2,)
        Clarke coordinates [m].
    n : int
        Number of joints, at least 3.
    pitch_radius : float
        d [m].
    axes : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        If a number is impossible.

    Examples
    --------
    >>> draw_tendon_ring(n=7).get_title()
    'n = 7 tendons and the displacement circle'
    """
    check_tendon_count(n)
    bar = 1e3 * check_last_axis(np.asarray(rho_bar, np.float64), 2, "rho_bar")
    d, axes = 1e3 * check_positive("pitch_radius", pitch_radius), new_axes(axes)
    rho = from_clarke(bar, n)
    directions = inverse_matrix(n)
    feet = rho[:, None] * directions
    axes.plot(*circle(d), color=GREY, lw=1)
    axes.plot(*(bar[:, None] / 2 + circle(np.hypot(*bar) / 2)), color=ORANGE, lw=1.5)
    for i, (x, y) in enumerate(d * directions):
        axes.plot([0, x], [0, y], color=GREY, lw=0.6, zorder=0)
        axes.text(1.25 * x, 1.18 * y, rf"$\rho_{{{i + 1}}}$={rho[i]:.1f}", ha="center", va="center")
    axes.scatter(*(d * directions).T, color=BLUE, zorder=3, label="tendons")
    axes.scatter(*feet.T, color=ORANGE, s=18, zorder=3, label=r"$\rho_i u_i$ [mm]")
    axes.annotate(
        "", bar, (0, 0), arrowprops={"arrowstyle": "->", "color": MAGENTA, "lw": 2}, zorder=4
    )
    axes.set_xlim(-1.6 * d, 1.6 * d)
    axes.set_ylim(-1.6 * d, 1.6 * d)
    axes.legend(loc="lower right", fontsize=7)
    return plane(axes, f"n = {n} tendons and the displacement circle", "mm")


def draw_tilted_ellipse(
    rho_bar: Any = (0.006, 0.004), n: int = 5, pitch_radius: float = 0.01, axes: Any = None
) -> Any:
    r"""Draw the ellipse of all displacements over the ring, seen in space.

    The points :math:`(d\cos\psi, d\sin\psi, \rho(\psi))` form an ellipse with the semi-axes
    :math:`\sqrt{d^2 + |\bar\rho|^2}` and d (the sheet).

    Parameters
    ----------
    rho_bar : array_like, shape (2,)
        Clarke coordinates [m].
    n : int
        Number of joints, at least 3.
    pitch_radius : float
        d [m].
    axes : mpl_toolkits.mplot3d.Axes3D, optional

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        If a number is impossible.

    Examples
    --------
    >>> draw_tilted_ellipse().name
    '3d'
    """
    bar = 1e3 * check_last_axis(np.asarray(rho_bar, np.float64), 2, "rho_bar")
    d, axes = 1e3 * check_positive("pitch_radius", pitch_radius), new_axes(axes, three_d=True)
    curve = tilted_ellipse(bar, d)
    axes.plot(*circle(d), 0.0, color=GREY, lw=1)
    axes.plot(*curve.T, color=ORANGE, lw=2)
    psi = joint_angles(n)
    for x, y, z in zip(d * np.cos(psi), d * np.sin(psi), from_clarke(bar, n), strict=True):
        axes.plot([x, x], [y, y], [0.0, z], color=BLUE, lw=1.5, marker="o", ms=3)
    top = curve[int(np.argmax(curve[:, 2]))]
    axes.plot(*np.stack([np.zeros(3), top]).T, color=MAGENTA, lw=1.5)
    size = np.hypot(d, np.hypot(*bar))
    axes.set_title(f"semi-axes {size:.1f} and {d:.1f} mm", fontsize=10)
    axes.set_zlabel(r"$\rho$ [mm]")
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    return axes


def tilted_ellipse(rho_bar: Any, pitch_radius: float, points: int = 361) -> FloatArray:
    """Return points (d cos psi, d sin psi, rho(psi)) of the tilted ellipse.

    Parameters
    ----------
    rho_bar : array_like, shape (2,)
        Clarke coordinates [m].
    pitch_radius : float
        d [m].
    points : int
        Points along the ellipse, the first again at the end.

    Returns
    -------
    ndarray, shape (points, 3)
        [m].

    Examples
    --------
    >>> curve = tilted_ellipse([0.3, 0.4], 1.2)
    >>> np.linalg.norm(curve, axis=1).max().round(4)  # the square root of 1.2^2 + 0.5^2
    np.float64(1.3)
    """
    x, y = circle(1.0, points)
    bar = np.asarray(rho_bar, np.float64)
    return np.stack([pitch_radius * x, pitch_radius * y, bar[0] * x + bar[1] * y], axis=1)


def draw_virtual_displacement(
    rho_bar: Any = (0.008, 0.006),
    pitch_radius: float = 0.01,
    length: float = 0.05,
    axes: Any = None,
) -> Any:
    """Draw the bent segment, the virtual tendon in its bending plane, and the Clarke coordinates.

    The virtual tendon runs at the pitch radius in the bending plane; it is shorter than the
    backbone by the virtual displacement, whose projections on the base's axes are the Clarke
    coordinates (the sheet).

    Parameters
    ----------
    rho_bar : array_like, shape (2,)
        Clarke coordinates [m], not both zero.
    pitch_radius, length : float
        d and l [m].
    axes : mpl_toolkits.mplot3d.Axes3D, optional

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        If a number is impossible.

    Examples
    --------
    >>> draw_virtual_displacement().get_title()
    'virtual displacement 10.0 mm'
    """
    bar = check_last_axis(np.asarray(rho_bar, np.float64), 2, "rho_bar")
    size, d = (
        check_positive("|rho_bar|", float(np.hypot(*bar))),
        check_positive("pitch_radius", pitch_radius),
    )
    axes = new_axes(axes, three_d=True)
    share = np.linspace(0.0, 1.0, 80)
    spine, turns = kinematics.segment_pose(share[:, None] * bar / d, length * share)
    offset = d * np.array([*bar / size, 0.0])
    virtual = spine + kinematics.rotate(turns, offset)
    axes.plot(*1e3 * spine.T, color=INK, lw=2.5, label="backbone")
    axes.plot(*1e3 * virtual.T, color=MAGENTA, lw=2, label="virtual tendon")
    axes.plot(*1e3 * np.stack([spine[-1], virtual[-1]]).T, color=GREY, lw=1)
    axes.plot(*1e3 * d * circle(1.0), 0.0, color=GREY, lw=1)
    for pair, name in (((bar[0], 0.0), "Re"), ((0.0, bar[1]), "Im")):
        axes.quiver(0, 0, 0, 1e3 * pair[0], 1e3 * pair[1], 0, color=ORANGE)
        axes.text(1.1e3 * pair[0], 1.1e3 * pair[1], 0.0, rf"$\rho_{{\mathrm{{{name}}}}}$")
    axes.quiver(0, 0, 0, *1e3 * bar, 0.0, color=MAGENTA)
    axes.set_title(f"virtual displacement {1e3 * size:.1f} mm", fontsize=10)
    axes.legend(fontsize=7)
    axes.set_aspect("equal")
    axes.locator_params(nbins=5)
    return axes


def draw_commutative_diagram(axes: Any = None) -> Any:
    """Draw how methods act on two numbers between M_P and its inverse (the sheet).

    Parameters
    ----------
    axes : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.

    Examples
    --------
    >>> len(draw_commutative_diagram().texts)
    8
    """
    axes = new_axes(axes)
    places = {
        r"$\rho \in Q \subset R^n$": (0.0, 1.0),
        r"$\rho^* \in Q \subset R^n$": (1.0, 1.0),
        r"$(\rho_{\mathrm{Re}}, \rho_{\mathrm{Im}})$": (0.0, 0.0),
        r"$(\rho^*_{\mathrm{Re}}, \rho^*_{\mathrm{Im}})$": (1.0, 0.0),
    }
    box = {"boxstyle": "round", "fc": "white", "ec": BLUE}
    for text, place in places.items():
        axes.text(*place, text, ha="center", va="center", bbox=box, fontsize=11)
    arrows = (
        ((0, 0.85), (0, 0.15), r"$M_P$", GREY, (-0.09, 0.5)),
        ((0.27, 0), (0.73, 0), r"method in $R^2$", GREY, (0.5, -0.09)),
        ((1, 0.15), (1, 0.85), r"$M_P^{-1}$", GREY, (1.11, 0.5)),
        ((0.27, 1), (0.73, 1), r"method in $R^n$", "#cccccc", (0.5, 1.06)),
    )
    for start, end, text, color, place in arrows:
        axes.add_patch(_arrow(start, end, color))
        axes.text(*place, text, ha="center", va="center", fontsize=9)
    axes.set_xlim(-0.35, 1.35)
    axes.set_ylim(-0.3, 1.3)
    axes.set_axis_off()
    return axes


def _arrow(start: tuple[float, float], end: tuple[float, float], color: str) -> Any:
    from matplotlib.patches import FancyArrowPatch

    return FancyArrowPatch(start, end, arrowstyle="->", mutation_scale=16, color=color, lw=1.6)


FIGURES: dict[str, Callable[[], Any]] = {
    "tendon_ring": draw_tendon_ring,
    "tilted_ellipse": draw_tilted_ellipse,
    "virtual_displacement": draw_virtual_displacement,
    "commutative_diagram": draw_commutative_diagram,
    "manifold_in_cube": draw_manifold_in_cube,
    "exploration": draw_exploration,
}
"""The pictures of the documentation by file name."""


def save_all(folder: str | Path, dpi: int = 120) -> list[Path]:
    """Save every figure as a PNG and return the files.

    Parameters
    ----------
    folder : str or Path
        Made if it is missing.
    dpi : int
        Dots per inch.

    Returns
    -------
    list of Path

    Raises
    ------
    ImportError
        If matplotlib is not installed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sorted(path.stem for path in save_all(folder, dpi=20))[:2]
    ['commutative_diagram', 'exploration']
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, draw in FIGURES.items():
        drawn = draw()
        paths.append(target / f"{name}.png")
        drawn.figure.savefig(paths[-1], dpi=dpi, metadata={"Software": None})
    return paths
