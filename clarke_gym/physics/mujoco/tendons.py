"""The tendons' spring law, in joint space and folded into Clarke coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import array_of
from clarke_gym.numerics.linear_map import AffineMap, block_diagonal, map_rows
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.robot import Robot, Segment
from clarke_gym.robots.stiffness import bending_stiffness

TENDON_NUMBERS = ("tendon_stiffness", "pretension", "intact", "friction")
"""Numbers of robots of their own that the springs of their tendons have."""


def tendon_offsets(segment: Segment) -> FloatArray:
    """Return where the tendons pierce a disk.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    ndarray, shape (n, 2)
        [m].

    Examples
    --------
    >>> tendon_offsets(Segment(n_tendons=4)).round(3)[0] + 0.0
    array([0.01, 0.  ])
    """
    return segment.pitch_radius_m * segment.matrices[1]


def folded_axes(segment: Segment) -> tuple[FloatArray, FloatArray]:
    r"""Return the two virtual tendons that stand for a segment's n taut ones.

    n springs of stiffness k at the offsets :math:`A = dD` resist a bending sum B with the moment
    :math:`k A^T A B`. Two springs along the eigenvectors of :math:`D^T D`, with k times its
    eigenvalues for stiffness and pitch radius d, do the same; for a symmetric ring both
    eigenvalues are n/2 and the two lengths are the Clarke coordinates.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    eigenvalues : ndarray, shape (2,)
    eigenvectors : ndarray, shape (2, 2)
        One a row.

    Examples
    --------
    >>> folded_axes(Segment(n_tendons=8))[0].round(12)
    array([4., 4.])
    """
    decoder = segment.matrices[1]
    gram = decoder.T @ decoder
    if np.allclose(gram, gram[0, 0] * np.eye(2), rtol=0.0, atol=1e-12 * gram[0, 0]):
        return np.diag(gram).copy(), np.eye(2)  # keeps the virtual tendons sparse
    values, vectors = np.linalg.eigh(gram)
    return values, vectors.T


class TendonSprings:
    r"""Linear springs between the drives and a robot's disks.

    A tendon of stiffness k and pretension :math:`T_0` whose drive has pulled in :math:`\rho_c`
    while the shape takes up :math:`\rho` carries :math:`T = T_0 + k(\rho_c - \rho)`, or nothing
    where a tendon would have to push.

    Parameters
    ----------
    robot : Robot

    Attributes
    ----------
    stiffness, pretension, preload : ndarray, shape (N,), or (B, N) once `vary` was called
        k [N/m], :math:`T_0` [N] and the stretch :math:`T_0/k` [m].
    intact : ndarray of bool
        Where tendons are not broken, likewise.
    friction : ndarray, shape (B,), or None
        Coefficients mu of friction with the holes.
    unfolded : ndarray of bool, shape (B,), or None
        Robots whose tendons are not alike, so that no two can stand for them.

    Examples
    --------
    >>> springs = TendonSprings(Robot())
    >>> springs.tension(np.zeros((1, 3)), np.array([[1e-5, 0.0, 1e-3]]))
    array([[ 8., 10.,  0.]])
    """

    def __init__(self, robot: Robot) -> None:
        segments, counts = robot.segments, robot.n_tendons
        self.robot = robot
        self.stiffness = np.repeat([s.tendon_stiffness_n_m for s in segments], counts)
        self.pretension = np.repeat([s.pretension_n for s in segments], counts)
        self.pulls_only = np.repeat([s.joint_type == "tendon" for s in segments], counts)
        self._first = np.cumsum([0, *counts[:-1]])
        self._pulling = np.array([s.joint_type == "tendon" for s in segments])
        self._nominal = self.stiffness, self.pretension
        self._scales = np.concatenate([folded_axes(segment)[0] for segment in segments])
        self.own = False
        self.intact = np.ones(robot.n_joints, dtype=bool)
        self.friction: FloatArray | None = None
        self.unfolded: NDArray[np.bool_] | None = None
        # How far a tendon's stretch can exceed the magnitude of the Clarke coordinates.
        self._gain = np.array([s.radii.max() / s.pitch_radius_m for s in segments])
        rotation = block_diagonal([folded_axes(segment)[1] for segment in segments])
        self.fold = -rotation.T
        self._unfold = rotation
        self.aligned = bool((rotation == np.eye(len(rotation))).all())
        self._derive()
        self._shape, self._shape_offset = self._equilibrium(self.preload)

    def _derive(self) -> None:
        """Derive what the slack check and the folded tendons need of stiffness and pretension."""
        self.preload = self.pretension / self.stiffness
        self._preload = self.preload[..., self._first]
        # Square of the shortest stretch that can slacken a tendon, with nothing off the manifold.
        self._least_room = float(((self._preload / self._gain) ** 2).min())
        self._surely_room = self._least_room * (1.0 - 1e-9)  # less than any rounding of a sum
        to_folded = self.robot.encoder.T @ self.fold
        rows = map_rows(np.atleast_2d(self.preload), to_folded)
        self._folded_preload = rows if self.own else rows[0]
        self._folded_preloads = rows[0].tolist()
        self._folded = AffineMap(self.fold, self._folded_preload)

    def vary(self, size: int, rows: NDArray[np.intp], numbers: Mapping[str, FloatArray]) -> None:
        """Give the tendons of some robots numbers of their own; those of all get a row each.

        Parameters
        ----------
        size : int
            Robots B.
        rows : ndarray of int, shape (R,)
        numbers : mapping of str to ndarray
            Of `TENDON_NUMBERS`, as `Physics.vary` has them.
        """
        if not self.own:
            self.own = True
            self.stiffness, self.pretension, self.intact = (
                np.tile(one, (size, 1)) for one in (*self._nominal, self.intact)
            )
        stiffness, pretension = self._nominal
        for name, values in numbers.items():
            if name == "tendon_stiffness":
                self.stiffness[rows] = stiffness * np.repeat(values, self.robot.n_tendons, axis=1)
            elif name == "pretension":
                self.pretension[rows] = pretension * np.repeat(values, self.robot.n_tendons, axis=1)
            elif name == "intact":
                self.intact[rows] = values
            elif name == "friction":
                if self.friction is None:
                    self.friction = np.zeros(size)
                self.friction[rows] = values
        # Two virtual tendons stand for n that are alike, each with its own force, none with more.
        self.unfolded = np.logical_not(self.intact.all(1))
        if self.friction is not None:
            self.unfolded |= self.friction > 0.0
        self._derive()

    def gains(self, folded: bool) -> FloatArray:
        """Return the stiffness [N/m] of every simulated tendon, 0 where it is broken.

        Parameters
        ----------
        folded : bool
            Whether virtual tendons are asked for.

        Returns
        -------
        ndarray, shape (B, 2S) or (B, N), or (N,) where no robot has its own
        """
        if folded:
            return self._scales * np.repeat(self.stiffness[:, self._first], 2, axis=1)
        return np.where(self.intact, self.stiffness, 0.0)

    def of(self, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return stiffness [N/m], 0 where broken, and stretch [m] of the tendons of some robots.

        Parameters
        ----------
        rows : ndarray of int, shape (R,)

        Returns
        -------
        ndarray, shape (R, N), twice
        """
        stiffness, size = self.gains(folded=False), (len(rows), 1)
        if self.own:
            return stiffness[rows], self.preload[rows]
        return np.tile(stiffness, size), np.tile(self.preload, size)

    def _equilibrium(self, preload: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the map from commanded Clarke coordinates to the unloaded robot's bending."""
        robot = self.robot
        flexural = [bending_stiffness(s) / s.length_m for s in robot.segments]
        sums = np.kron(np.tril(np.ones((robot.n_segments,) * 2)), np.eye(2))
        # Displacement of every tendon per bending of every segment.
        moments = (robot.decoder * np.repeat(robot.pitch_radii, 2)) @ sums
        pull = moments.T * self.stiffness
        matrix = np.linalg.inv(pull @ moments + np.diag(np.repeat(flexural, 2))) @ pull
        return matrix @ robot.decoder, matrix @ preload

    def equilibrium(self, clarke: FloatArray) -> FloatArray:
        """Return the bending at which taut tendons balance an unloaded backbone.

        Parameters
        ----------
        clarke : ndarray, shape (B, S, 2)
            Commanded Clarke coordinates [m].

        Returns
        -------
        ndarray, shape (B, 2S)
            Bending vectors of the segments [rad].
        """
        rows = np.ascontiguousarray(clarke, dtype=np.float64).reshape(len(clarke), -1)
        return map_rows(rows, self._shape.T) + self._shape_offset

    def tension(
        self,
        command: FloatArray,
        displacement: FloatArray,
        rows: NDArray[np.intp] | None = None,
    ) -> FloatArray:
        """Return the tensions [N], (R, N), of robots `rows` that told and reached displacements."""
        pick = slice(None) if rows is None or not self.own else rows
        tension = self.pretension[pick] + self.stiffness[pick] * (command - displacement)
        tension = np.where(self.pulls_only, np.maximum(tension, 0.0), tension)
        return np.where(self.intact[pick], tension, 0.0) if self.own else tension

    def drag(
        self,
        rows: NDArray[np.intp],
        command: FloatArray,
        displacement: FloatArray,
        wrapped: FloatArray,
    ) -> FloatArray:
        r"""Return the largest friction [N] between the tendons of some robots and their holes.

        Euler and Eytelwein: a tendon of tension T that is pulled in over a bend of phi has
        :math:`T e^{-\mu\varphi}` left after the angle :math:`\varphi`, on the mean of all angles
        :math:`T (1 - e^{-\mu\phi})/(\mu\phi)`; the rest is friction.

        Parameters
        ----------
        rows : ndarray of int, shape (R,)
        command, displacement : ndarray, shape (R, N)
            Of these robots [m].
        wrapped : ndarray, shape (R, N)
            The bend phi that each tendon passes [rad].

        Returns
        -------
        ndarray, shape (R, N)
        """
        if self.friction is None:
            return np.zeros_like(command)
        pull = np.abs(self.tension(command, displacement, rows))
        grip = self.friction[rows, None] * wrapped
        safe = np.maximum(grip, 1e-6)  # below, rounding would be all that is left
        drag: FloatArray = pull * np.where(grip < safe, 0.5 * grip, 1.0 + np.expm1(-safe) / safe)
        return drag

    def lengths(self, command: JointVector) -> FloatArray:
        """Return the commanded change of every tendon's length [m], shape (B, N)."""
        return -command.joint(self.robot) - self.pretension / self.stiffness

    def folded_lengths(self, command: JointVector) -> Any:
        """Return the commanded lengths of the virtual tendons [m], shape (B, 2S), or 2S floats."""
        return self._folded.of_components(command.parts)

    def surely_taut(
        self,
        start: list[float],
        end: list[float],
        meanwhile: list[list[float]],
        after: list[float],
    ) -> bool:
        """Return whether no tendon of one robot can have gone slack: a quick look before `slack`.

        Parameters
        ----------
        start, end : list of 2S floats
            Commanded lengths of the virtual tendons before and after K time steps [m].
        meanwhile : list of 2S lists of K - 1 floats
            Actual lengths of the virtual tendons between the time steps [m].
        after : list of 2S floats
            Those after the last one [m].

        Returns
        -------
        bool
        """
        room, preload = self._surely_room, self._folded_preloads
        for i in range(0, len(start), 2):
            j, xs = i + 1, meanwhile[i]
            x0, y0, steps = start[i], start[j], len(xs) + 1
            dx, dy = (end[i] - x0) / steps, (end[j] - y0) / steps
            x0, y0 = x0 - preload[i], y0 - preload[j]
            for x, y in zip(xs, meanwhile[j]):  # noqa: B905 (costs as much as three rounds)
                x0, y0 = x0 + dx, y0 + dy
                x, y = x - x0, y - y0
                if x * x + y * y > room:
                    return False
            x, y = after[i] - (x0 + dx), after[j] - (y0 + dy)
            if x * x + y * y > room:
                return False
        return True

    def slack(
        self,
        start: JointVector,
        end: JointVector,
        gap: FloatArray,
        rows: NDArray[np.intp] | None = None,
    ) -> NDArray[np.bool_]:
        """Return which robots had a tendon that would have pushed after one of K time steps.

        The implicit integrator applies the tension at the end of each step, so that is what must
        not be negative.

        Parameters
        ----------
        start, end : JointVector
            The drives before and after the K steps, of B robots.
        gap : ndarray, shape (B, K, 2S)
            Actual less commanded lengths of the virtual tendons at the end of every step [m].
        rows : ndarray of int, optional
            Which robots these are; all by default.

        Returns
        -------
        ndarray of bool, shape (B,)
        """
        robot = self.robot
        batch, steps = gap.shape[:2]
        stiffness, pretension, preload, offset = self._of(rows)
        gap = gap + offset
        pairs = gap.reshape(batch, steps, robot.n_segments, 2)
        square = np.einsum("bksi,bksi->bks", pairs, pairs)
        off = [
            None if part.off_manifold is None else array_of(part.off_manifold)
            for part in (start, end)
        ]
        result = np.zeros(batch, dtype=bool)
        taut = all(part is None for part in off)
        # Enough for all tendons of a segment, at a cost that does not grow with their number.
        if taut and square.max() <= self._least_room:
            return result
        room = preload
        for part in off:
            if part is not None:
                lowest = np.minimum.reduceat(part, self._first, axis=1)
                room = np.minimum(room, preload + lowest)
        room = np.maximum(room, 0.0) / self._gain
        doubtful = ((square.max(1) > room * room) & self._pulling).any(1)
        if not doubtful.any():
            return result
        picked = np.flatnonzero(doubtful)
        folded = gap[picked].reshape(-1, gap.shape[-1])
        stretch = map_rows(map_rows(folded, self._unfold), robot.decoder.T)
        stretch = stretch.reshape(len(picked), steps, -1)
        ramp = (np.arange(1, steps + 1) / steps)[:, None]
        for part, weight in zip(off, (1.0 - ramp, ramp), strict=True):
            if part is not None:
                stretch = stretch + weight * part[picked, None, :]
        if self.own:
            stiffness, pretension = stiffness[picked], pretension[picked]
        tension = pretension + stiffness * stretch
        result[picked] = (tension[:, :, self.pulls_only] < 0.0).any((1, 2))
        return result

    def _of(self, rows: NDArray[np.intp] | None) -> tuple[FloatArray, ...]:
        """Return stiffness, pretension, preload and folded preload for (R, K, ...) numbers."""
        numbers = self.stiffness, self.pretension, self._preload, self._folded_preload
        if not self.own:
            return numbers
        pick = slice(None) if rows is None else rows
        stiffness, pretension, preload, offset = (one[pick] for one in numbers)
        return stiffness[:, None], pretension[:, None], preload, offset[:, None]
