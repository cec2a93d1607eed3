"""Codecs between a policy's numbers and joint-space vectors.

Robots are computed in Clarke coordinates. A representation that spans the manifold is therefore
mapped by a small matrix, or by none at all, at a cost that does not depend on how many tendons
there are.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clarke_gym.numerics.arrays import FloatArray, from_components
from clarke_gym.numerics.batch import Batch, Factors, PairMap, array_of, check_finite, copied
from clarke_gym.numerics.linear_map import DiagonalMap, LinearMap, map_rows
from clarke_gym.representations.registry import Representation, to_polar
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.robots.robot import Robot

_TINY = 1e-12
"""Entries of products of matrices below this are rounding."""


class Decoder:
    """Reads actions written in a representation.

    Parameters
    ----------
    representation : Representation
    robot : Robot
    batch : Batch

    Raises
    ------
    ValueError
        If no action of it bends some segment some way.
    """

    def __init__(self, representation: Representation, robot: Robot, batch: Batch) -> None:
        self.representation, self._batch = representation, batch
        onto = robot.encoder @ representation.decoder
        if np.linalg.matrix_rank(onto) < 2 * robot.n_segments:
            raise ValueError(
                f"representation {representation.name!r} does not bend all segments in both "
                "directions: it can be observed, but not acted in"
            )
        # No tendon has to be looked at where all actions lie on the manifold.
        self._on_manifold = bool(
            np.abs(robot.decoder @ onto - representation.decoder).max() < _TINY
        )
        square = onto.shape[0] == onto.shape[1] and not representation.polar
        self._same = bool(square and np.abs(onto - np.eye(len(onto))).max() < _TINY)
        self._raw = np.array_equal(representation.decoder, np.eye(robot.n_joints))
        self._to_clarke = LinearMap(onto.T.copy())
        self._to_joints = LinearMap(representation.decoder.T.copy())
        self._splitter = Splitter(robot, batch)
        self._shape = batch.shape(representation.size)

    def read(self, action: ArrayLike) -> JointVector:
        """Return the joint-space vectors of actions, in units of the limits.

        Parameters
        ----------
        action : array_like, shape (B, K), or (K,) in the scalar environment

        Raises
        ------
        ValueError, TypeError
            If the action has another shape, is not finite, or holds no real numbers.
        """
        array: NDArray[Any] = np.asarray(action)
        if array.shape != self._shape or array.dtype.kind not in "fiu":
            self._refuse(array)
        batch = self._batch
        given = batch.given(array)
        if self._raw:
            return self._splitter.given(given)
        check_finite(given)
        if self._same:
            return JointVector(batch.columns(given))
        if self.representation.polar:
            given = batch.given(self.representation.linear(array.astype(np.float64)))
        if self._on_manifold:
            return JointVector(batch.mapped(self._to_clarke, given))
        joints = from_components(batch.mapped(self._to_joints, given))
        return self._splitter.rows(joints)

    def _refuse(self, array: NDArray[Any]) -> NoReturn:
        if array.dtype.kind not in "fiu":
            raise TypeError(f"action must hold real numbers, got {array.dtype} in {array!r}")
        raise ValueError(
            f"action must have the shape {self._shape}, got {array.shape}, in the representation "
            f"{self.representation.name!r}"
        )


class Encoder:
    """Writes joint-space vectors, the blocks that lead every observation, in a representation.

    Parameters
    ----------
    representation : Representation
    robot : Robot
    scales : sequence of ndarray, shape (S,)
        What the numbers of each block are divided by, one a segment.
    bounds : sequence of (float, ndarray of shape (N,))
        Largest magnitude of each block's scaled Clarke coordinates, and of its off-manifold
        numbers.
    clips : bool
        Whether numbers can pass the bounds for a moment, and are clipped there.
    """

    def __init__(
        self,
        representation: Representation,
        robot: Robot,
        scales: Sequence[FloatArray],
        bounds: Sequence[tuple[float, FloatArray]],
        clips: bool = True,
    ) -> None:
        self.representation, self._clips = representation, clips
        encoder, size = representation.encoder, representation.size
        self.width = len(scales) * size
        # The margin covers float32 rounding of the encoding itself.
        self.high = np.concatenate(
            [(1.0 + 1e-6) * representation.encoded_bound(robot, most, off) for most, off in bounds]
        ).astype(np.float32)
        ends = np.cumsum([0, *representation.counts])
        places = [
            (slice(start, stop), slice(2 * k, 2 * k + 2))
            for k, (start, stop) in enumerate(itertools.pairwise(ends))
        ]
        onto = encoder @ robot.decoder
        pieces = [[onto[place] / scale[k] for k, place in enumerate(places)] for scale in scales]
        own = np.zeros_like(onto, dtype=bool)
        for place in places:
            own[place] = True
        # What a segment's coordinates are made of is mostly that segment's own.
        coupled = bool(np.abs(onto[~own]).max(initial=0.0) > _TINY)
        self._coupled = [(onto / np.repeat(s, 2)).T.copy() for s in scales] if coupled else None
        residual = encoder - encoder @ robot.decoder @ robot.encoder
        self.sees_off = bool(np.abs(residual).max() > _TINY)
        """Whether anything off the manifold shows."""
        raw = np.array_equal(encoder, np.eye(len(encoder)))
        self._off_map = None if raw else encoder.T.copy()
        self._blocks = [
            (
                slice(b * size, (b + 1) * size),
                PairMap(pieces[b]),
                Factors(1.0 / np.repeat(scale, robot.n_tendons)),
            )
            for b, scale in enumerate(scales)
        ]
        # Axes along those of the Clarke coordinates need no sums.
        self._diagonal = None
        if not (self.sees_off or representation.polar or coupled) and _along_axes(pieces):
            numbers = [np.diag(piece) for block in pieces for piece in block]
            self._diagonal = DiagonalMap(np.concatenate(numbers).tolist())

    def write(self, vectors: Sequence[JointVector], out: NDArray[np.float32]) -> None:
        """Write the vectors of all blocks into an array (B, width).

        Parameters
        ----------
        vectors : sequence of JointVector
            One a block, in the units of the scales.
        out : ndarray of float32, shape (B, width)
        """
        if self._diagonal is not None:
            parts = vectors[0].parts
            for vector in vectors[1:]:
                parts = parts + vector.parts
            self._diagonal.into(parts, out)
        elif self._coupled is not None:
            for vector, (place, _, _), onto in zip(
                vectors, self._blocks, self._coupled, strict=True
            ):
                out[:, place] = map_rows(from_components(vector.parts), onto)
        else:
            for vector, (place, pairs, factors) in zip(vectors, self._blocks, strict=True):
                off, block = vector.off_manifold, out[:, place]
                if off is None or not self.sees_off:
                    pairs.into(vector.parts, block)
                elif self._off_map is None:
                    pairs.into(vector.parts, block, off, factors)
                else:
                    pairs.into(vector.parts, block)
                    block += map_rows(array_of(factors.times(copied(off))), self._off_map)
        if self.representation.polar:
            to_polar(out)
        if self._clips:
            np.minimum(np.maximum(out, -self.high, out=out), self.high, out=out)


def _along_axes(pieces: Sequence[Sequence[FloatArray]]) -> bool:
    """Return whether all maps of pairs are diagonal."""
    return all(
        piece.shape == (2, 2)
        and np.abs(piece - np.diag(np.diag(piece))).max() < _TINY * np.abs(piece).max()
        for block in pieces
        for piece in block
    )
