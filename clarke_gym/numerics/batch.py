"""One robot in floats, or many in arrays: who computes is told which, and writes one formula.

A batch of robots is handled by *components*: k numbers for each robot are k components, each a
float where one robot is computed by itself and an array of shape (B,) otherwise. Off-manifold
numbers, one a tendon, are kept the same way, as a list of floats or as an array (N, B), whose rows
are its components. A NumPy call on one number costs as much as thirty operations on floats.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from operator import add, mul
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number, namespace, not_finite
from clarke_gym.numerics.linear_map import LinearMap

Components: TypeAlias = Sequence[Number]
"""A list of floats (one robot), or a list of arrays (B,) or an array (k, B) of their components."""


class Batch(ABC):
    """How many robots are computed, and in what.

    Parameters
    ----------
    size : int
        Number of robots B.
    """

    def __init__(self, size: int) -> None:
        self.size = size

    @abstractmethod
    def shape(self, width: int) -> tuple[int, ...]:
        """Return the shape of what users give and get for `width` numbers a robot."""

    @abstractmethod
    def given(self, array: NDArray[Any]) -> Any:
        """Return users' numbers, of shape `shape(k)`, as `mapped` and `columns` take them."""

    @abstractmethod
    def columns(self, given: Any) -> list[Number]:
        """Return the k components of given numbers."""

    @abstractmethod
    def mapped(self, linear: LinearMap, given: Any) -> list[Number]:
        """Return the components of the products of given numbers with a matrix."""

    @abstractmethod
    def off_columns(self, given: Any) -> Any:
        """Return a copy of given numbers of all tendons as off-manifold components."""

    @abstractmethod
    def components(self, rows: NDArray[Any]) -> list[Number]:
        """Return the k components of an array (B, k)."""

    @abstractmethod
    def off_components(self, rows: FloatArray) -> Any:
        """Return the off-manifold components of an array (B, N)."""

    @abstractmethod
    def seen(self, rows: NDArray[Any]) -> Any:
        """Return an array (B, ...) as users see it: without the first axis for one robot."""

    @abstractmethod
    def put(self, parts: Components, rows: NDArray[np.intp], values: NDArray[Any]) -> list[Number]:
        """Return components with those of the robots `rows` replaced by `values` (R, k)."""

    @abstractmethod
    def without(self, off: Any, rows: NDArray[np.intp]) -> Any:
        """Return off-manifold components with zeros for the robots `rows`."""

    def zeros(self, width: int) -> list[Number]:
        """Return `width` components that are zero."""
        return self.components(np.zeros((self.size, width)))


class One(Batch):
    """One robot by itself, in Python floats."""

    def __init__(self) -> None:
        super().__init__(1)

    def shape(self, width: int) -> tuple[int, ...]:
        """Return (width,)."""
        return (width,)

    def given(self, array: NDArray[Any]) -> list[float]:
        """Return a list of floats."""
        if array.dtype != np.float32:
            array = array.astype(np.float64, copy=False)
        numbers: list[float] = array.tolist()
        return numbers

    def columns(self, given: list[float]) -> list[Number]:
        """Return the numbers themselves."""
        return given

    def mapped(self, linear: LinearMap, given: list[float]) -> list[Number]:
        """Return the products of one row."""
        return linear.of_numbers(given).tolist()

    def off_columns(self, given: list[float]) -> list[float]:
        """Return a new list."""
        return list(given)

    def components(self, rows: NDArray[Any]) -> list[Number]:
        """Return the floats of the only row."""
        return rows[0].tolist()

    def off_components(self, rows: FloatArray) -> list[float]:
        """Return the floats of the only row."""
        return rows[0].tolist()

    def seen(self, rows: NDArray[Any]) -> Any:
        """Return the only row, a NumPy scalar where it holds one number."""
        return rows[0]

    def put(self, parts: Components, rows: NDArray[np.intp], values: NDArray[Any]) -> list[Number]:
        """Return the new numbers, if any."""
        return values[0].tolist() if len(rows) else list(parts)

    def without(self, off: Any, rows: NDArray[np.intp]) -> Any:
        """Return no off-manifold part where the robot is among `rows`."""
        return None if len(rows) else off


class Many(Batch):
    """B robots, in arrays."""

    def shape(self, width: int) -> tuple[int, ...]:
        """Return (B, width)."""
        return (self.size, width)

    def given(self, array: NDArray[Any]) -> FloatArray:
        """Return rows in double precision."""
        return array.astype(np.float64, copy=False)

    def columns(self, given: FloatArray) -> list[Number]:
        """Return the columns, each in memory of its own."""
        return list(np.ascontiguousarray(given.T))

    def mapped(self, linear: LinearMap, given: FloatArray) -> list[Number]:
        """Return the columns of the products; their bits do not depend on B."""
        return self.columns(linear.of_rows(given))

    def off_columns(self, given: FloatArray) -> FloatArray:
        """Return a new array (N, B)."""
        return np.array(given.T, order="C")

    def components(self, rows: NDArray[Any]) -> list[Number]:
        """Return the columns."""
        return self.columns(rows)

    def off_components(self, rows: FloatArray) -> FloatArray:
        """Return a new array (N, B)."""
        return np.array(rows.T, order="C")

    def seen(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Return the array."""
        return rows

    def put(self, parts: Components, rows: NDArray[np.intp], values: NDArray[Any]) -> list[Number]:
        """Return copies with the values of some robots replaced."""
        result: list[Number] = []
        for part, column in zip(parts, values.T, strict=True):
            part = part.copy()
            part[rows] = column
            result.append(part)
        return result

    def without(self, off: Any, rows: NDArray[np.intp]) -> Any:
        """Return a copy with zeros in the columns of some robots."""
        if off is None:
            return None
        off = off.copy()
        off[:, rows] = 0.0
        return off


def as_batch(batch: Batch | int) -> Batch:
    """Return a batch; a number stands for that many robots in arrays."""
    return batch if isinstance(batch, Batch) else Many(batch)


# --- off-manifold numbers, one a tendon ----------------------------------------------------------


def check_finite(given: Any) -> None:
    """Refuse given numbers of which one is not finite, or so large that its square is not.

    Raises
    ------
    ValueError
    """
    if isinstance(given, list):
        square_sum(given)
    else:
        _refuse_infinite(np.vdot(given, given), given)


def _refuse_infinite(square: float, given: Any) -> None:
    if not math.isfinite(square):
        raise ValueError(not_finite(np.asarray(given)))


def square_sum(given: Any) -> Number:
    """Return each robot's sum of squares of given numbers.

    Raises
    ------
    ValueError
        If a number is not finite, or so large that its square is not.
    """
    if isinstance(given, list):
        length = math.hypot(*given)
        size: Any = length * length
        _refuse_infinite(size, given)
    else:
        size = np.vecdot(given, given)
        _refuse_infinite(size.sum(), given)
    return size


def largest_magnitude(off: Any) -> Number:
    """Return each robot's largest magnitude.

    Examples
    --------
    >>> largest_magnitude([0.5, -2.0]), largest_magnitude(np.array([[0.5, 1.0], [-2.0, 0.0]]))
    (2.0, array([2., 1.]))
    """
    if isinstance(off, list):
        return max(max(off), -min(off))
    return np.maximum(np.maximum.reduce(off), -np.minimum.reduce(off))


def bounded(off: Any, limit: float) -> Any:
    """Return numbers scaled down until none of a robot's passes `limit`; arrays are changed.

    Examples
    --------
    >>> bounded([0.5, -4.0], 2.0)
    [0.25, -2.0]
    """
    largest = largest_magnitude(off)
    if isinstance(off, list):
        scale = limit / largest if largest > limit else 1.0
        return off if scale == 1.0 else [x * scale for x in off]
    if largest.max() > limit:
        off *= limit / np.maximum(largest, limit)
    return off


def difference(a: Any, b: Any) -> Any:
    """Return a - b as new numbers; None stands for zeros, but not for both."""
    if isinstance(a, list) or isinstance(b, list):
        if a is None:
            return [-y for y in b]
        return list(a) if b is None else [x - y for x, y in zip(a, b, strict=True)]
    if b is None:
        return a.copy()
    return -b if a is None else a - b


def added(change: Any, held: Any) -> Any:
    """Return held + change; `change` may be used up, and `held` None stands for zeros."""
    if held is None:
        return change
    if isinstance(change, list):
        return [x + y for x, y in zip(held, change, strict=True)]
    change += held
    return change


def times(off: Any, factor: float) -> Any:
    """Return numbers times a factor; arrays are changed."""
    if isinstance(off, list):
        return [x * factor for x in off]
    off *= factor
    return off


class Factors:
    """A factor for each tendon.

    Parameters
    ----------
    factors : ndarray, shape (N,)
    """

    def __init__(self, factors: FloatArray) -> None:
        self._floats, self.column = factors.tolist(), factors[:, None].copy()

    def times(self, off: Any) -> Any:
        """Return numbers times their factors; arrays are changed."""
        if isinstance(off, list):
            return list(map(mul, off, self._floats))
        off *= self.column
        return off


def slope(start: Any, end: Any, duration: float) -> Any:
    """Return the rates at which lists of floats, or arrays, change within a duration.

    Examples
    --------
    >>> slope([0.0, 0.5], [0.5, 0.5], 0.25)
    [2.0, 0.0]
    """
    if isinstance(start, list):
        return [(b - a) / duration for a, b in zip(start, end, strict=True)]
    return (end - start) / duration


def copied(off: Any) -> Any:
    """Return numbers that may be changed."""
    return off if isinstance(off, list) else off.copy()


def each(number: Number) -> FloatArray:
    """Return a number for each robot as an array (B,)."""
    return np.array([number]) if isinstance(number, float) else number


def any_of(found: Any) -> bool:
    """Return whether something was found of any robot."""
    return bool(found) if isinstance(found, bool) else bool(found.any())


def only_where(found: Any, off: Any) -> Any:
    """Return numbers with zeros for robots that are not `found`, or None where none is."""
    if isinstance(off, list):
        return off if found else None
    if not found.any():
        return None
    if not found.all():
        off[:, np.logical_not(found)] = 0.0
    return off


def broken(parts: Components, off: Any) -> NDArray[np.bool_] | None:
    """Return which robots' components hold what is no finite number; None for no robot."""
    total: Any = sum(parts)
    if isinstance(total, float):
        total = total if off is None else total + sum(off)
        return None if math.isfinite(total) else np.array([True])
    total = total if off is None else total + off.sum(0)
    return None if math.isfinite(total.sum()) else np.logical_not(np.isfinite(total))


def picked(parts: Components, rows: NDArray[np.intp]) -> Any:
    """Return the components of some robots; of one robot by itself, all."""
    if isinstance(parts[0], float):
        return parts
    if isinstance(parts, np.ndarray):
        return parts[:, rows]
    return [part[rows] for part in parts]


def array_of(parts: Any) -> FloatArray:
    """Return components as an array (B, k)."""
    return np.array(parts, dtype=np.float64, ndmin=2) if isinstance(parts, list) else parts.T


# --- pairs ---------------------------------------------------------------------------------------


class PairMap:
    """The n numbers of the tendons of each segment from its two components, and scaled.

    Number i of segment s is ``scale_i (d_i0 x_s + d_i1 y_s)``. Written out, so that a float gets
    the bits of a batch at the cost of its few products.

    Parameters
    ----------
    decoders : sequence of ndarray, shape (n, 2)
        One a segment.

    Examples
    --------
    >>> PairMap([np.array([[1.0, 0.0], [0.0, 2.0]])]).rest([1.0, 1.0], [1.5, 2.0])
    [0.5, 0.0]
    """

    def __init__(self, decoders: Sequence[FloatArray]) -> None:
        starts = np.cumsum([0, *(len(d) for d in decoders)])
        self._arrays = [
            (slice(start, stop), d[:, :1].copy(), d[:, 1:].copy())
            for start, stop, d in zip(starts[:-1], starts[1:], decoders, strict=True)
        ]
        self._scratch = np.empty((2, 0, 0))
        self._floats = [(2 * s, x, y) for s, d in enumerate(decoders) for x, y in d.tolist()]

    def into(
        self, parts: Components, out: NDArray[Any], off: Any = None, factors: Factors | None = None
    ) -> None:
        """Write the numbers of all segments, and what is off the manifold, into an array (B, N).

        Without BLAS, whose single-precision kernels give rows other bits than their neighbours.
        """
        if isinstance(parts[0], float):
            numbers = [x * parts[k] + y * parts[k + 1] for k, x, y in self._floats]
            if off is not None and factors is not None:
                numbers = list(map(add, numbers, factors.times(off)))
            out[0] = numbers
            return
        for s, (place, x, y) in enumerate(self._arrays):
            onto, more = self._room(len(self._floats), len(out))[:, place]
            np.multiply(x, parts[2 * s], out=onto)
            onto += np.multiply(y, parts[2 * s + 1], out=more)
            if off is not None and factors is not None:
                onto += np.multiply(off[place], factors.column[place], out=more)
            out[:, place] = onto.T

    def _room(self, width: int, count: int) -> FloatArray:
        """Return memory for products: fresh one for large batches costs more than they do."""
        if self._scratch.shape != (2, width, count):
            self._scratch = np.empty((2, width, count))
        return self._scratch

    def rest(self, parts: Components, off: Any) -> Any:
        """Return what numbers of all tendons have beyond those of `parts`; arrays are changed."""
        if isinstance(off, list):
            return [
                number - (x * parts[k] + y * parts[k + 1])
                for number, (k, x, y) in zip(off, self._floats, strict=True)
            ]
        for s, (place, x, y) in enumerate(self._arrays):
            onto, more = self._room(*off.shape)[:, place]
            np.multiply(x, parts[2 * s], out=onto)
            onto += np.multiply(y, parts[2 * s + 1], out=more)
            off[place] -= onto
        return off


def shortened(x: Number, y: Number, limit: Any) -> tuple[Number, Number]:
    """Return a vector shortened to at most a limit, its direction kept: radial saturation.

    Parameters
    ----------
    x, y : float, array or tensor
        Components.
    limit : float, or array like x

    Returns
    -------
    tuple of 2

    Examples
    --------
    >>> shortened(3.0, 4.0, 10.0), shortened(3.0, 4.0, 2.5)
    ((3.0, 4.0), (1.5, 2.0))
    """
    if isinstance(x, float):
        length = math.sqrt(x * x + y * y)
        if length <= limit:
            return x, y
        scale: Number = limit / length
    elif namespace(x) is np:
        scale = limit / np.maximum(np.sqrt(x * x + y * y), limit)
    else:  # the slope of a root is not finite at zero
        square = x * x + y * y
        outside = square > limit * limit
        safe = square.where(outside, square.new_ones(()))
        scale = (limit / safe.sqrt()).where(outside, square.new_ones(()))
    return x * scale, y * scale
