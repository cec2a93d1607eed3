"""Pictures of the manifold in joint space, and of what exploration noise does on and off it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from clarke_gym.clarke.manifold import limit_polygon
from clarke_gym.clarke.transform import from_clarke, project, to_clarke
from clarke_gym.figures.canvas import BLUE, GREY, MAGENTA, ORANGE, circle, new_axes
from clarke_gym.numerics.arrays import FloatArray

TENDONS = (3, 7, 11)


def draw_manifold_in_cube(limit: float = 0.01, axes: Any = None) -> Any:
    """Draw the manifold of three tendons inside the cube of their displacements.

    The plane through the origin cuts the cube in a hexagon, the exact limit in Clarke coordinates;
    the circle inscribed in it is the limit that holds for every number of tendons.

    Parameters
    ----------
    limit : float
        Largest displacement of a tendon [m].
    axes : mpl_toolkits.mplot3d.Axes3D, optional

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    ValueError
        If `limit` is not positive.

    Examples
    --------
    >>> draw_manifold_in_cube().get_title()
    'the manifold of 3 tendons in its cube'
    """
    corners = 1e3 * limit_polygon(3, limit)
    axes, r = new_axes(axes, three_d=True), 1e3 * limit
    for k in range(3):
        for a in (-r, r):
            for b in (-r, r):
                edge = np.insert([[a, b], [a, b]], k, [-r, r], axis=1)
                axes.plot(*edge.T, color=GREY, lw=0.8)
    hexagon = from_clarke(np.vstack([corners, corners[:1]]), 3)
    axes.plot_trisurf(*from_clarke(np.vstack([[[0, 0]], corners]), 3).T, color=BLUE, alpha=0.25)
    axes.plot(*hexagon.T, color=BLUE, lw=1.5, label="joint limits on the manifold")
    axes.plot(*from_clarke(circle(r).T, 3).T, color=ORANGE, lw=1.5, label="inscribed circle")
    axes.plot([-r, r], [-r, r], [-r, r], color=MAGENTA, lw=1, ls="--", label="common mode")
    for axis, name in zip("xyz", ("1", "2", "3"), strict=True):
        getattr(axes, f"set_{axis}label")(rf"$\rho_{name}$ [mm]")
    axes.set_title("the manifold of 3 tendons in its cube", fontsize=10)
    axes.legend(fontsize=7)
    axes.locator_params(nbins=5)
    axes.view_init(elev=24.0, azim=20.0)
    return axes


def exploration_shares(
    n: int, samples: int = 20_000, seed: int = 0
) -> tuple[FloatArray, FloatArray]:
    r"""Return how far uniform raw actions reach on the manifold, and off it.

    Parameters
    ----------
    n : int
        Number of tendons, at least 3.
    samples : int
        Number of actions, uniform in [-1, 1]^n.
    seed : int
        Of the generator.

    Returns
    -------
    on, off : ndarray, shape (samples,)
        :math:`|M_P a|` and the root mean square of :math:`(I - P)a`.

    Raises
    ------
    TypeError, ValueError
        If `n` is not a whole number or below 3.

    Examples
    --------
    >>> exploration_shares(7)[0].mean().round(2)
    np.float64(0.39)
    """
    actions = np.random.default_rng(seed).uniform(-1.0, 1.0, (samples, n))
    off = actions - project(actions)
    return np.linalg.norm(to_clarke(actions), axis=1), np.sqrt((off**2).mean(axis=1))


def draw_exploration(tendons: Sequence[int] = TENDONS, axes: Any = None) -> Any:
    """Draw where uniform exploration ends up: on the manifold, and off it, against n.

    Raw actions of more tendons cancel: their reach on the manifold shrinks, and the rest pulls
    tendons against each other. Clarke actions, uniform on the disk, do not depend on n.

    Parameters
    ----------
    tendons : sequence of int
        Numbers of tendons.
    axes : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ImportError
        If matplotlib is not installed.
    TypeError, ValueError
        If a number of tendons is impossible.

    Examples
    --------
    >>> len(draw_exploration((3, 7)).collections)
    3
    """
    axes = new_axes(axes)
    colours = (BLUE, ORANGE, MAGENTA, GREY)
    for k, n in enumerate(tendons):
        on, off = exploration_shares(n, 3000)
        axes.scatter(on, off, s=3, alpha=0.25, color=colours[k % 4], label=f"raw, n = {n}")
    disk = np.sqrt(np.random.default_rng(1).random(600))
    axes.scatter(disk, np.zeros(600), s=5, color="black", label="Clarke, any n", clip_on=False)
    axes.set_xlabel("on the manifold: size of the Clarke coordinates")
    axes.set_ylabel("off the manifold: rms of the rest")
    axes.set_xlim(0.0, 1.4)
    axes.set_ylim(0.0, 1.0)
    axes.set_title("uniform exploration, as shares of a tendon's limit", fontsize=10)
    for handle in axes.legend(fontsize=7, markerscale=3).legend_handles:
        handle.set_alpha(1.0)
    return axes
