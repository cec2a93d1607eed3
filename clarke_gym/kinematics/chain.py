r"""The chain of spaces of a continuum robot, every map by the paper's name.

.. code-block:: text

    actuator --f_dyn--> joint --M_P--> Clarke --1/(l d)--> arc --f_ind--> pose
    motor angle         rho            rho_bar      kappa (cos, sin)      (p, xi)
                          \______________ f_dep _______________/

Robot-dependent and robot-independent mappings follow Webster and Jones, IJRR 2010; their form in
Clarke coordinates is the paper's (Grassmann and Burgner-Kahrs).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from clarke_gym import kinematics
from clarke_gym.kinematics.inverse import segment_inverse
from clarke_gym.kinematics.inverse_chain import inverse_kinematics
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, as_floating, matrix_like
from clarke_gym.numerics.checks import check_choice, check_pairs
from clarke_gym.robots.joints import joint_type
from clarke_gym.robots.robot import Robot

SPACES = ("actuator", "joint", "clarke", "arc", "pose")
"""From the motors to the tip."""


@dataclass(frozen=True, eq=False)
class SpaceChain:
    """Maps between the spaces of one robot, and their Jacobians.

    Shapes with N tendons and S segments: motor angles and displacements (..., N), Clarke
    coordinates and curvature vectors (..., S, 2), position (..., 3), quaternion (..., 4). NumPy
    arrays and torch tensors alike; gradients flow through every map.

    Parameters
    ----------
    robot : Robot
        Its segments' joint types say which way the actuators' strokes point.
    spool_radius_m : float
        Displacement a motor makes per radian [m/rad].

    Raises
    ------
    ValueError
        If `spool_radius_m` is not positive and finite.

    Examples
    --------
    >>> chain = SpaceChain(Robot())
    >>> position, quaternion = chain.f_ind(chain.f_dep(np.array([0.01, -0.005, -0.005])))
    >>> position.round(4) + 0.0  # one radian of bend in a segment of 0.2 m
    array([0.0919, 0.    , 0.1683])
    """

    robot: Robot
    spool_radius_m: float = 0.01

    def __post_init__(self) -> None:
        if not (np.isfinite(self.spool_radius_m) and self.spool_radius_m > 0.0):
            raise ValueError(f"spool_radius_m must be positive, got {self.spool_radius_m!r}")

    @cached_property
    def _strokes(self) -> FloatArray:
        """Displacement per radian of every motor, shape (N,)."""
        signs = [float(joint_type(s.joint_type).sign) for s in self.robot.segments]
        return self.spool_radius_m * np.repeat(signs, self.robot.n_tendons)

    # --- actuator and joint ---------------------------------------------------------------------

    def f_dyn(self, motor_angles: Array) -> Array:
        """Return the displacements rho [m] of motor angles [rad], both (..., N).

        Examples
        --------
        >>> SpaceChain(Robot(), 0.02).f_dyn(np.array([0.5, -0.25, -0.25]))
        array([ 0.01 , -0.005, -0.005])
        """
        angles = self._joints(motor_angles, "motor_angles")
        return angles * matrix_like(self._strokes, angles)

    def f_dyn_inverse(self, rho: Array) -> Array:
        """Return the motor angles [rad] of displacements rho [m], both (..., N).

        Examples
        --------
        >>> SpaceChain(Robot(), 0.02).f_dyn_inverse(np.array([0.01, -0.005, -0.005]))
        array([ 0.5 , -0.25, -0.25])
        """
        rho = self._joints(rho, "rho")
        return rho / matrix_like(self._strokes, rho)

    # --- joint and Clarke -----------------------------------------------------------------------

    def to_clarke(self, rho: Array) -> Array:
        """Return the Clarke coordinates [m] (..., S, 2) of displacements [m] (..., N).

        Examples
        --------
        >>> SpaceChain(Robot()).to_clarke(np.array([0.01, -0.005, -0.005])).round(6) + 0.0
        array([[0.01, 0.  ]])
        """
        rho = self._joints(rho, "rho")
        clarke = rho @ matrix_like(self.robot.encoder.T, rho)
        return clarke.reshape(*clarke.shape[:-1], self.robot.n_segments, 2)

    def from_clarke(self, clarke: Array) -> Array:
        """Return the displacements [m] (..., N) of Clarke coordinates [m] (..., S, 2).

        Examples
        --------
        >>> SpaceChain(Robot()).from_clarke(np.array([[0.01, 0.0]])).round(6)
        array([ 0.01 , -0.005, -0.005])
        """
        clarke = check_pairs(clarke, self.robot.lengths, "clarke")
        flat = clarke.reshape(*clarke.shape[:-2], 2 * self.robot.n_segments)
        return flat @ matrix_like(self.robot.decoder.T, flat)

    # --- Clarke and arc -------------------------------------------------------------------------

    def clarke_to_arc(self, clarke: Array) -> Array:
        """Return curvature vectors kappa (cos theta, sin theta) [1/m] of Clarke coordinates.

        Examples
        --------
        >>> SpaceChain(Robot()).clarke_to_arc(np.array([[0.01, 0.0]]))
        array([[5., 0.]])
        """
        bending = kinematics.clarke_to_bending(clarke, self.robot.pitch_radii)
        return bending / self._lengths_like(bending)

    def arc_to_clarke(self, curvature: Array) -> Array:
        """Return Clarke coordinates [m] of curvature vectors [1/m], both (..., S, 2).

        Examples
        --------
        >>> SpaceChain(Robot()).arc_to_clarke(np.array([[5.0, 0.0]]))
        array([[0.01, 0.  ]])
        """
        return kinematics.bending_to_clarke(self._bending(curvature), self.robot.pitch_radii)

    # --- joint and arc --------------------------------------------------------------------------

    def f_dep(self, rho: Array) -> Array:
        """Return the robot-dependent mapping: displacements (..., N) to curvature (..., S, 2).

        Examples
        --------
        >>> SpaceChain(Robot()).f_dep(np.array([0.01, -0.005, -0.005])).round(6) + 0.0
        array([[5., 0.]])
        """
        return self.clarke_to_arc(self.to_clarke(rho))

    def f_dep_inverse(self, curvature: Array) -> Array:
        """Return the displacements [m] (..., N) on the manifold of curvature vectors [1/m].

        Examples
        --------
        >>> SpaceChain(Robot()).f_dep_inverse(np.array([[5.0, 0.0]])).round(6)
        array([ 0.01 , -0.005, -0.005])
        """
        return self.from_clarke(self.arc_to_clarke(curvature))

    # --- arc and pose ---------------------------------------------------------------------------

    def f_ind(self, curvature: Array) -> tuple[Array, Array]:
        """Return the robot-independent mapping: tip position [m] and quaternion (w, x, y, z).

        Examples
        --------
        >>> position, quaternion = SpaceChain(Robot()).f_ind(np.zeros((1, 2)))
        >>> position
        array([0. , 0. , 0.2])
        """
        return kinematics.forward(self._bending(curvature), self.robot.lengths)

    def f_ind_inverse(
        self, position: Array, quaternion: Array | None = None, **search: Any
    ) -> Array:
        """Return curvature vectors [1/m] (..., S, 2) that bring the tip to a pose.

        One segment has the closed form that points the tip at `position`; several, an orientation
        and what tells the search are left to `inverse_kinematics`. The robot's bending limits hold.

        Parameters
        ----------
        position : array, shape (..., 3)
            [m].
        quaternion : array, shape (..., 4), optional
            Orientation to match, too.
        **search
            Keyword arguments of `clarke_gym.kinematics.inverse_chain.inverse_kinematics`.

        Raises
        ------
        ValueError
            If the tip cannot be brought within 1e-6 of the robot's length, or not within its
            bending limit; the message says how near, or how far it would have to bend.

        Examples
        --------
        >>> SpaceChain(Robot()).f_ind_inverse(np.array([0.0, 0.0, 0.2]))
        array([[0., 0.]])
        """
        if self.robot.n_segments == 1 and quaternion is None and not search:
            bending, gap = segment_inverse(position, self.robot.length_m)
            bending, error = self._within(bending[..., None, :]), abs(gap) / self.robot.length_m
        else:
            search = {"max_bending": self.robot.max_bending, **search}
            bending, error = inverse_kinematics(
                position, self.robot.lengths, quaternion=quaternion, **search
            )
        worst = _largest(error)
        if not worst <= 1e-6:
            raise ValueError(
                f"no shape found for the pose: the nearest misses by {100.0 * worst:.3g} % of the "
                "robot's length"
            )
        return bending / self._lengths_like(bending)

    def _within(self, bending: Array) -> Array:
        """Return the bend of a robot of one segment, or say that it is beyond its limit."""
        size, limit = (bending * bending).sum(-1) ** 0.5, float(self.robot.max_bending[0])
        most = _largest(size)
        if most > limit * (1.0 + 1e-6):
            raise ValueError(
                f"no shape found for the pose: it takes a bend of {most:.6g} rad, beyond the "
                f"robot's limit of {limit:.6g} rad"
            )
        return bending

    # --- Jacobians ------------------------------------------------------------------------------

    def jacobian(self, source: str, target: str, curvature: Array | None = None) -> Array:
        """Return the Jacobian between two spaces, products of neighbours included.

        Coordinates are flattened: (S, 2) to 2S. The pose's are the tip's twist, linear [m] and
        then angular [rad] in the base frame.

        Parameters
        ----------
        source, target : str
            Names of `SPACES`.
        curvature : array, shape (..., S, 2), optional
            Where the mapping is differentiated; needed if one of the spaces is the pose.

        Returns
        -------
        array, shape (..., target size, source size)
            From the pose, or from Clarke coordinates to joints, the pseudo-inverse.

        Raises
        ------
        ValueError
            If a name is unknown or `curvature` is missing.

        Examples
        --------
        >>> chain = SpaceChain(Robot())
        >>> straight = np.zeros((1, 2))
        >>> chain.jacobian("joint", "pose", straight).shape
        (6, 3)
        """
        for name, value in (("source", source), ("target", target)):
            check_choice(name, value, SPACES)
        start, end = SPACES.index(source), SPACES.index(target)
        if start == end:
            raise ValueError(f"source and target must differ, got {source!r} twice")
        if curvature is None:
            if "pose" in (source, target):
                raise ValueError("curvature must be given: the pose depends on it nonlinearly")
            curvature = np.zeros((self.robot.n_segments, 2))
        product = None
        for k in range(start, end) if end > start else range(start - 1, end - 1, -1):
            step = self._neighbours(k, end > start, curvature)
            product = step if product is None else step @ product
        return product

    def _neighbours(self, k: int, forward: bool, curvature: Array) -> Array:
        """Return the Jacobian from space k to k + 1, or backwards."""
        if k == 3:
            jacobian = tip_jacobian(self._bending(curvature), self.robot.lengths)
            jacobian = jacobian * matrix_like(np.repeat(self.robot.lengths, 2), jacobian)
            return jacobian if forward else array_namespace(jacobian).linalg.pinv(jacobian)
        to_arc = self._clarke_to_arc
        matrices = [
            (np.diag(self._strokes), np.diag(1.0 / self._strokes)),
            (self.robot.encoder, self.robot.decoder),
            (to_arc, np.asarray(np.linalg.inv(to_arc), np.float64)),
        ]
        return matrix_like(matrices[k][0 if forward else 1], curvature)

    @cached_property
    def _clarke_to_arc(self) -> FloatArray:
        """Linear map from Clarke coordinates to curvature vectors, shape (2S, 2S)."""
        count = self.robot.n_segments
        units = np.eye(2 * count).reshape(2 * count, count, 2)
        columns: FloatArray = self.clarke_to_arc(units).reshape(2 * count, 2 * count)
        return columns.T

    # --- helpers --------------------------------------------------------------------------------

    def _joints(self, array: Array, name: str) -> Array:
        array, count = as_floating(array, name), self.robot.n_joints
        if array.ndim == 0 or array.shape[-1] != count:
            raise ValueError(f"{name} must have a last axis of {count}, got {tuple(array.shape)}")
        return array

    def _lengths_like(self, pairs: Array) -> Array:
        return matrix_like(self.robot.lengths[:, None], pairs)

    def _bending(self, curvature: Array) -> Array:
        curvature = check_pairs(curvature, self.robot.lengths, "curvature")
        return curvature * self._lengths_like(curvature)


def _largest(array: Array) -> float:
    """Return the largest of some numbers that are not negative; 0 of none."""
    return float(array.max()) if math.prod(array.shape) else 0.0
