r"""Published improved state parametrisations, each a constant, swap or sign away from Clarke.

That all of them are special cases of Clarke coordinates is the claim of Grassmann and
Burgner-Kahrs, "Clarke Coordinates Are Generalized Improved State Parametrization for Continuum
Robots", RA-L 2025 (arXiv 2503.12265; only its opening was read). The explicit forms below are this
package's reading of the papers; `Parametrisation.status` says how far each was confirmed. In terms
of the bending vector :math:`\beta = \phi(\cos\theta, \sin\theta) = \bar\rho/d`:

==================  ===========================================  ===============
name                coordinates                                  from Clarke
==================  ===========================================  ===============
della_santina_2020  :math:`(\Delta_x, \Delta_y) = d\,\beta`      nothing to do
allen_2020          :math:`(u, v) = (-\beta_y, \beta_x)`         1/d, swap, sign
qu_2016             :math:`(\phi\cos\theta, \phi\sin\theta)`     1/d
cao_2022            :math:`(\phi\cos\theta, \phi\sin\theta)`     1/d
dian_2022           :math:`(\phi\cos\theta, \phi\sin\theta)`     1/d
==================  ===========================================  ===============

A chart that differs by a similarity only cannot change what a learner can do, beyond the scale; as
representations of an environment, where limits set the scale, most of them coincide with Clarke.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clarke_gym.numerics.arrays import Array, FloatArray, matrix_like
from clarke_gym.numerics.checks import check_last_axis, check_positive

UNCONFIRMED = (
    "Unconfirmed: the paper was not available; the two-parameter arc form is from memory, and its "
    "axes may be swapped or signed differently."
)


@dataclass(frozen=True)
class Parametrisation:
    """One published parametrisation of a constant-curvature segment by two numbers.

    Parameters
    ----------
    name : str
    source : str
        The publication.
    joints : str
        The numbers of joints that it was published for, as far as known; the map takes any.
    turn : tuple of 2 rows
        Orthogonal matrix from Clarke coordinates to the published axes.
    angular : bool
        True if its coordinates are angles [rad], Clarke over the pitch radius d; else lengths [m].
    status : str
        How far the definition was confirmed.

    Examples
    --------
    >>> PARAMETRISATIONS["della_santina_2020"].from_clarke(np.array([0.01, 0.0]), 0.01)
    array([0.01, 0.  ])
    """

    name: str
    source: str
    joints: str
    turn: tuple[tuple[float, float], tuple[float, float]]
    angular: bool
    status: str

    @property
    def matrix(self) -> FloatArray:
        """The orthogonal matrix `turn`, shape (2, 2)."""
        return np.array(self.turn)

    def from_clarke(self, rho_bar: Array, pitch_radius: float) -> Array:
        """Return the published coordinates of Clarke coordinates.

        Parameters
        ----------
        rho_bar : array, shape (..., 2)
            [m].
        pitch_radius : float
            d [m].

        Returns
        -------
        array, shape (..., 2)
            [rad] if `angular`, else [m].

        Raises
        ------
        TypeError, ValueError
            If `rho_bar` is not real, its last axis is not 2, or `pitch_radius` not positive.

        Examples
        --------
        >>> PARAMETRISATIONS["allen_2020"].from_clarke(np.array([0.01, 0.0]), 0.01) + 0.0
        array([0., 1.])
        """
        rho_bar = check_last_axis(rho_bar, 2, "rho_bar")
        scale = 1.0 / check_positive("pitch_radius", pitch_radius) if self.angular else 1.0
        return rho_bar @ matrix_like(scale * self.matrix.T, rho_bar)

    def to_clarke(self, coordinates: Array, pitch_radius: float) -> Array:
        """Return the Clarke coordinates of published ones, the inverse of `from_clarke`.

        Parameters
        ----------
        coordinates : array, shape (..., 2)
            [rad] if `angular`, else [m].
        pitch_radius : float
            d [m].

        Returns
        -------
        array, shape (..., 2)
            [m].

        Raises
        ------
        TypeError, ValueError
            If `coordinates` is not real, its last axis is not 2, or `pitch_radius` not positive.

        Examples
        --------
        >>> PARAMETRISATIONS["allen_2020"].to_clarke(np.array([0.0, 1.0]), 0.01)
        array([0.01, 0.  ])
        """
        coordinates = check_last_axis(coordinates, 2, "coordinates")
        scale = check_positive("pitch_radius", pitch_radius) if self.angular else 1.0
        return coordinates @ matrix_like(scale * self.matrix, coordinates)


_SAME = ((1.0, 0.0), (0.0, 1.0))

PARAMETRISATIONS = {
    entry.name: entry
    for entry in (
        Parametrisation(
            "della_santina_2020",
            "C. Della Santina, A. Bicchi, D. Rus, On an Improved State Parametrization for Soft "
            "Robots With Piecewise Constant Curvature and Its Use in Model Based Control, RA-L "
            "2020",
            "4",
            _SAME,
            angular=False,
            status="Half differences of opposite fibres, Delta_x = d phi cos theta and Delta_y = "
            "d phi sin theta, agree with an independent public implementation; the paper itself "
            "was not available. Its third coordinate is the change of length.",
        ),
        Parametrisation(
            "allen_2020",
            "Allen et al., Closed-Form Non-Singular Constant-Curvature Continuum Manipulator "
            "Kinematics, RoboSoft 2020",
            "3, 4",
            ((0.0, -1.0), (1.0, 0.0)),
            angular=True,
            status="A pure rotation between the ends is confirmed by the opening of arXiv "
            "2503.12265; that (u, v) are the components of its rotation vector, and their order "
            "and signs, are from memory.",
        ),
        Parametrisation(
            "qu_2016",
            "Qu, Lau et al., ROBIO 2016",
            "unknown",
            _SAME,
            angular=True,
            status=UNCONFIRMED,
        ),
        Parametrisation(
            "cao_2022",
            "Cao, Xie et al., Journal of Mechanisms and Robotics 2022",
            "unknown",
            _SAME,
            angular=True,
            status=UNCONFIRMED,
        ),
        Parametrisation(
            "dian_2022",
            "Dian, Guo et al., IEEE Access 2022",
            "3",
            _SAME,
            angular=True,
            status=UNCONFIRMED,
        ),
    )
}
"""Published parametrisations by name."""
