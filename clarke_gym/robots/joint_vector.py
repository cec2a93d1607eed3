"""Joint-space vectors, split by the projector into a part on the manifold and the rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number, from_components
from clarke_gym.numerics.batch import (
    Batch,
    Many,
    PairMap,
    any_of,
    array_of,
    broken,
    check_finite,
    only_where,
    picked,
    square_sum,
)
from clarke_gym.numerics.linear_map import LinearMap, map_rows
from clarke_gym.robots.robot import Robot

OFF_MANIFOLD_RESOLUTION = 1e-6
"""Off-manifold parts below this share of a vector are rounding (float32 carries 6e-8)."""


@dataclass(slots=True)
class JointVector:
    """A batch of joint-space vectors in two orthogonal parts.

    Parameters
    ----------
    parts : list of 2S numbers
        Clarke coordinates of the segments' tendons, the part on the manifold, in the order of the
        robot's encoder.
    off_manifold : components of N numbers, or None
        The rest, (I - P) rho; None where no robot has any. An array has the shape (N, B).
    """

    parts: list[Number]
    off_manifold: Any = None

    @classmethod
    def from_clarke(
        cls, clarke: FloatArray, off_manifold: FloatArray | None = None, batch: Batch | None = None
    ) -> JointVector:
        """Make vectors of Clarke coordinates (B, S, 2) and off-manifold numbers (B, N)."""
        batch = Many(len(clarke)) if batch is None else batch
        parts = batch.components(clarke.reshape(len(clarke), -1))
        return cls(parts, None if off_manifold is None else batch.off_components(off_manifold))

    @property
    def clarke(self) -> FloatArray:
        """Clarke coordinates, shape (B, S, 2)."""
        array = from_components(self.parts)
        return array.reshape(len(array), -1, 2)

    def joint(self, robot: Robot) -> FloatArray:
        """Return the numbers of all tendons, shape (B, N)."""
        rho = map_rows(from_components(self.parts), robot.decoder.T)
        return rho if self.off_manifold is None else rho + array_of(self.off_manifold)

    def rows(self, pick: NDArray[np.intp]) -> JointVector:
        """Return some robots' part of a batch; of one robot by itself, the whole."""
        off = self.off_manifold
        return JointVector(picked(self.parts, pick), None if off is None else picked(off, pick))

    def with_rows(self, batch: Batch, rows: NDArray[np.intp], clarke: FloatArray) -> JointVector:
        """Return a copy with some robots on the manifold at `clarke` (rows, S, 2)."""
        parts = batch.put(self.parts, rows, clarke.reshape(len(rows), -1))
        return JointVector(parts, batch.without(self.off_manifold, rows))

    def broken(self) -> NDArray[np.bool_] | None:
        """Return which robots' vectors hold what is no finite number; None for none."""
        return broken(self.parts, self.off_manifold)

    def get_state(self) -> dict[str, Any]:
        """Return a copy as arrays."""
        off = self.off_manifold
        return {
            "clarke": self.clarke,
            "off_manifold": None if off is None else array_of(off).copy(),
        }

    @classmethod
    def from_state(cls, batch: Batch, state: dict[str, Any]) -> JointVector:
        """Return the vector of `get_state`, bit for bit."""
        return cls.from_clarke(state["clarke"], state["off_manifold"], batch)


class Splitter:
    """Splits joint-space numbers into their parts on and off the manifold.

    Parameters
    ----------
    robot : Robot
    batch : Batch
    keeps_off : bool
        Whether anybody looks at what is off the manifold; it is left out otherwise.

    Examples
    --------
    >>> vector = Splitter(Robot(), Many(1)).rows(np.array([[1.0, -0.5, -0.5]]))
    >>> vector.clarke.round(12) + 0.0, vector.off_manifold
    (array([[[1., 0.]]]), None)
    """

    def __init__(self, robot: Robot, batch: Batch, keeps_off: bool = True) -> None:
        self._batch, self._keeps_off = batch, keeps_off
        self._encode = LinearMap(robot.encoder.T.copy())
        decoders = [segment.matrices[1] for segment in robot.segments]
        self._onto = PairMap(decoders)
        grams = np.array([decoder.T @ decoder for decoder in decoders])
        self._grams = [
            (gram[0, 0].item(), gram[1, 1].item(), _without_rounding(2.0 * gram[0, 1]))
            for gram in grams
        ]

    def rows(self, rows: FloatArray) -> JointVector:
        """Return the vectors of an array (B, N)."""
        return self.given(self._batch.given(self._batch.seen(rows)))

    def given(self, numbers: Any) -> JointVector:
        """Return the vectors of users' numbers, as `Batch.given` gives them.

        Raises
        ------
        ValueError
            If a number is not finite.
        """
        if not self._keeps_off:
            check_finite(numbers)
            return JointVector(self._batch.mapped(self._encode, numbers))
        size = square_sum(numbers)
        parts = self._batch.mapped(self._encode, numbers)
        onto: Number = 0.0
        for k, (xx, yy, xy) in enumerate(self._grams):
            a, b = parts[2 * k], parts[2 * k + 1]
            # |D m|^2 from the segments' Gram matrices; the rest is off the manifold.
            onto = onto + (xx * a * a + yy * b * b)
            if xy:
                onto = onto + xy * a * b
        found = size - onto > OFF_MANIFOLD_RESOLUTION**2 * size
        if not any_of(found):
            return JointVector(parts)
        off = self._onto.rest(parts, self._batch.off_columns(numbers))
        return JointVector(parts, only_where(found, off))


def _without_rounding(number: float) -> float:
    return float(number) if abs(number) > 1e-12 else 0.0
