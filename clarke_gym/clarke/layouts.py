r"""Arbitrary joint locations: encoder and decoder, other designs, extensible segments.

Joints at angles :math:`\psi_i` and distances :math:`d_i` have the displacements
:math:`\rho_i = d_i(\beta_x\cos\psi_i + \beta_y\sin\psi_i)` of a segment of bending vector
:math:`\beta`. Clarke coordinates stay :math:`\bar\rho = d\,\beta` with one nominal radius d. The
sheet's :math:`M_P\,\mathrm{diag}(1/d_i)` is the exact decoder for symmetric angles only, where it
agrees on the manifold with the least-squares inverse used here; for other angles it is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from clarke_gym.clarke.transform import joint_angles, layout_matrices
from clarke_gym.numerics.arrays import (
    Array,
    FloatArray,
    as_floating,
    beside,
    matrix_like,
    parameter,
)


@dataclass(frozen=True, eq=False)
class Layout:
    """Where the joints of one segment sit.

    Parameters
    ----------
    angles : array_like, shape (n,)
        Joint angles psi_i [rad].
    radii : float or array_like, shape (n,)
        Distances d_i from the backbone [m].
    pitch_radius : float, optional
        Nominal radius d that scales Clarke coordinates [m]; the mean of `radii` by default.

    Raises
    ------
    ValueError, TypeError
        If there are fewer than 3 joints, a number is impossible, or all joints lie on one line
        through the backbone.

    Examples
    --------
    >>> layout = Layout([0.1, 1.9, 4.0], [0.01, 0.012, 0.009])
    >>> rho = layout.from_clarke(np.array([0.003, -0.001]))
    >>> layout.to_clarke(rho).round(6)
    array([ 0.003, -0.001])
    """

    angles: FloatArray
    radii: FloatArray
    pitch_radius: float

    def __init__(
        self,
        angles: Sequence[float] | FloatArray,
        radii: float | Sequence[float] | FloatArray,
        pitch_radius: float | None = None,
    ) -> None:
        nominal = float(np.mean(radii)) if pitch_radius is None else float(pitch_radius)
        layout_matrices(angles, radii, nominal)  # says what is wrong, if anything
        psi = np.array(angles, dtype=np.float64)
        for name, value in (
            ("angles", psi),
            ("radii", np.broadcast_to(np.asarray(radii, np.float64), psi.shape).copy()),
        ):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "pitch_radius", nominal)

    @classmethod
    def symmetric(cls, n: int, radius: float = 1.0) -> Layout:
        """Return the ring of `n` equally spaced joints of the sheet.

        Examples
        --------
        >>> Layout.symmetric(4, 0.01).n
        4
        """
        return cls(joint_angles(n), radius)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.angles)

    @cached_property
    def encoder(self) -> FloatArray:
        """Clarke transform of this layout, shape (2, n): the least-squares inverse of `decoder`."""
        return layout_matrices(self.angles, self.radii, self.pitch_radius)[0]

    @cached_property
    def decoder(self) -> FloatArray:
        """Inverse Clarke transform of this layout, shape (n, 2)."""
        return layout_matrices(self.angles, self.radii, self.pitch_radius)[1]

    @cached_property
    def extensible_encoder(self) -> FloatArray:
        """Decodes displacements to Clarke coordinates and shortening, shape (3, n).

        Raises
        ------
        ValueError
            If the joints cannot tell a change of length from a bend: all of them on one line.
        """
        decoder = self.extensible_decoder
        if np.linalg.cond(decoder) > 1e8:
            raise ValueError(
                f"the joints at angles {self.angles.tolist()} rad cannot tell a change of length "
                "from a bend"
            )
        return np.asarray(np.linalg.pinv(decoder), np.float64)

    @cached_property
    def extensible_decoder(self) -> FloatArray:
        """Maps Clarke coordinates and shortening to displacements, shape (n, 3)."""
        return np.column_stack([self.decoder, np.ones(self.n)])

    def to_clarke(self, rho: Array) -> Array:
        """Return Clarke coordinates of displacements.

        Parameters
        ----------
        rho : array, shape (..., n)
            Displacements [m].

        Returns
        -------
        array, shape (..., 2)
            [m].

        Raises
        ------
        TypeError, ValueError
            If `rho` is not real or its last axis is not n.

        Examples
        --------
        >>> Layout.symmetric(4, 0.01).to_clarke(np.array([1.0, 0.0, -1.0, 0.0])).round(6) + 0.0
        array([1., 0.])
        """
        return self._last(rho, self.n, "rho") @ matrix_like(self.encoder.T, as_floating(rho, "rho"))

    def from_clarke(self, rho_bar: Array) -> Array:
        """Return the displacements of Clarke coordinates.

        Parameters
        ----------
        rho_bar : array, shape (..., 2)
            [m].

        Returns
        -------
        array, shape (..., n)
            [m].

        Raises
        ------
        TypeError, ValueError
            If `rho_bar` is not real or its last axis is not 2.

        Examples
        --------
        >>> Layout([0.0, np.pi / 2, 4.0], 0.01).from_clarke(np.array([1.0, 2.0])).round(3)
        array([ 1.   ,  2.   , -2.167])
        """
        rho_bar = self._last(rho_bar, 2, "rho_bar")
        return rho_bar @ matrix_like(self.decoder.T, rho_bar)

    def project(self, rho: Array) -> Array:
        """Return the displacements of this layout's manifold nearest to `rho`, both (..., n).

        Examples
        --------
        >>> Layout.symmetric(3, 0.01).project(np.ones(3)).round(12) + 0.0
        array([0., 0., 0.])
        """
        return self.from_clarke(self.to_clarke(rho))

    def to_extensible(self, rho: Array, rest_length: Array | float) -> tuple[Array, Array]:
        r"""Return Clarke coordinates and length of an extensible segment.

        The length is the common mode: :math:`\rho_i = (l_0 - l) + \beta\cdot(d_i u_i)`, where
        :math:`\rho_i` is measured from the straight segment at rest.

        Parameters
        ----------
        rho : array, shape (..., n)
            Displacements [m].
        rest_length : float or array, shape (...)
            Length l_0 at rho = 0 [m].

        Returns
        -------
        rho_bar : array, shape (..., 2)
            Clarke coordinates [m]; the bending vector times the pitch radius.
        length : array, shape (...)
            Present length l [m].

        Raises
        ------
        TypeError, ValueError
            If shapes do not fit, or the layout cannot tell length from bend.

        Examples
        --------
        >>> ring, rho = Layout.symmetric(3, 0.01), np.full(3, -0.01)
        >>> ring.to_extensible(rho, 0.2)[1].round(6)
        np.float64(0.21)
        """
        rho = self._last(rho, self.n, "rho")
        decoded = rho @ matrix_like(self.extensible_encoder.T, rho)
        return decoded[..., :2], parameter(rest_length, rho) - decoded[..., 2]

    def from_extensible(
        self, rho_bar: Array, length: Array | float, rest_length: Array | float
    ) -> Array:
        """Return displacements of an extensible segment, the inverse of `to_extensible`.

        Parameters
        ----------
        rho_bar : array, shape (..., 2)
            Clarke coordinates [m].
        length, rest_length : float or array, shape (...)
            Present and rest length [m].

        Returns
        -------
        array, shape (..., n)
            [m].

        Raises
        ------
        TypeError, ValueError
            If `rho_bar` is not real or its last axis is not 2.

        Examples
        --------
        >>> Layout.symmetric(3, 0.01).from_extensible(np.zeros(2), 0.21, 0.2).round(6)
        array([-0.01, -0.01, -0.01])
        """
        rho = self.from_clarke(rho_bar)
        shorter = parameter(rest_length, rho) - parameter(length, rho)
        return rho + beside(shorter)

    def _last(self, array: Array, size: int, name: str) -> Array:
        array = as_floating(array, name)
        if array.ndim == 0 or array.shape[-1] != size:
            raise ValueError(f"{name} must have a last axis of {size}, got {tuple(array.shape)}")
        return array


def map_design(
    rho: Array, source: Layout, target: Layout, length_ratio: Array | float = 1.0
) -> Array:
    r"""Return the displacements that give another design the same shape.

    :math:`\rho_B = (l_B/l_A) A_B A_A^+ \rho_A`: equal curvature; with a ratio of 1, equal bending
    vector. (The idea is that of "Clarke Transform and Encoder-Decoder Architecture for Arbitrary
    Joints Locations in Displacement-Actuated Continuum Robots", arXiv 2412.16401, whose own
    normalisation was not read; this form is derived here.)

    Parameters
    ----------
    rho : array, shape (..., n_A)
        Displacements of the source design [m].
    source, target : Layout
    length_ratio : float or array, shape (...)
        l_B / l_A for equal curvature.

    Returns
    -------
    array, shape (..., n_B)
        [m].

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real or its last axis does not fit the source.

    Examples
    --------
    >>> three, four = Layout.symmetric(3, 0.01), Layout.symmetric(4, 0.005)
    >>> map_design(np.array([0.002, -0.001, -0.001]), three, four).round(6) + 0.0
    array([ 0.001,  0.   , -0.001,  0.   ])
    """
    bending = source.to_clarke(rho) / source.pitch_radius
    bending = bending * beside(parameter(length_ratio, bending))
    return target.from_clarke(bending * target.pitch_radius)
