"""What lets one formula serve floats, NumPy and torch arrays, and any batch size bit for bit."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import DTypeLike, NDArray

Array: TypeAlias = Any
"""A NumPy array or a torch tensor; functions return the kind that they were given."""

FloatArray: TypeAlias = NDArray[np.float64]

Number: TypeAlias = Any
"""One component of a batch: a float for a batch of one, or an array of shape (B,)."""


class FloatMath:
    """The functions that formulas need, for Python floats.

    A NumPy call on one number costs as much as thirty operations on floats. Roots are exact in
    both; the other functions go through NumPy, so that a float gets the bits of a batch.
    """

    pi = math.pi
    sqrt = staticmethod(math.sqrt)

    @staticmethod
    def maximum(a: float, b: Any) -> float:
        """Return the larger number, faster than `max`."""
        return float(b) if b > a else a

    @staticmethod
    def cos(x: float) -> float:
        """Return the cosine."""
        return float(np.cos(x))

    @staticmethod
    def sin(x: float) -> float:
        """Return the sine."""
        return float(np.sin(x))


def namespace(*arrays: Array) -> Any:
    """Return the functions for these operands: `FloatMath`, NumPy or torch (never imported)."""
    if isinstance(arrays[0], float):
        return FloatMath
    torch = sys.modules.get("torch")
    if torch is not None and any(isinstance(array, torch.Tensor) for array in arrays):
        return torch
    return np


def array_namespace(*arrays: Array) -> Any:
    """Return NumPy or torch; for formulas that need more than `FloatMath` knows."""
    xp = namespace(*arrays)
    return np if xp is FloatMath else xp


def as_floating(array: Array, name: str) -> Array:
    """Return `array` as a floating-point array, keeping float32, float64 and torch tensors.

    Raises
    ------
    TypeError
        If `array` does not hold real numbers.
    """
    if namespace(array) not in (np, FloatMath):
        if not array.is_floating_point():
            raise TypeError(f"{name} must be a floating-point tensor, got {array.dtype}")
        return array
    result = np.asarray(array)
    if result.dtype.kind in "iub":
        return result.astype(np.float64)
    if result.dtype.kind != "f":
        raise TypeError(f"{name} must hold real numbers, got dtype {result.dtype}")
    return result


def matrix_like(matrix: FloatArray, like: Array) -> Array:
    """Return a constant matrix in the array kind, precision and device of `like`."""
    xp = namespace(like)
    if xp is np:
        return matrix.astype(like.dtype, copy=False)
    return xp.as_tensor(matrix.copy(), dtype=like.dtype, device=like.device)


def parameter(value: Array, like: Array) -> Number:
    """Return a design number as a Python float, which keeps the precision of what it meets.

    Arrays of numbers, one for each row of a batch, become arrays of the kind of `like`.
    """
    if isinstance(value, int | float):  # NumPy's float64 is one of them
        return float(value)
    if namespace(value) is not np:
        return value
    array = np.asarray(value)
    return float(array) if array.ndim == 0 else matrix_like(array, like)


def beside(number: Number) -> Number:
    """Return a design number as a factor of vectors: a float, or an array with one more axis."""
    return number if isinstance(number, float) else number[..., None]


def parameters(values: Array, like: Array) -> list[Number]:
    """Return `parameter` of each entry along the last axis: one a segment."""
    if getattr(values, "ndim", 1) > 1:
        return [parameter(values[..., k], like) for k in range(values.shape[-1])]
    return [parameter(value, like) for value in values]


def not_finite(action: NDArray[Any]) -> str:
    """Return the message for an action that holds NaN, an infinity or a number beyond 1e150."""
    rows = action.reshape(-1, action.shape[-1])
    row = int(np.argmin((np.abs(rows) < 1e150).all(axis=1)))
    return f"action must be finite, got {rows[row].tolist()} (row {row})"


def constant(value: float | Sequence[float] | FloatArray) -> FloatArray:
    """Return a design number as an array without axes, or numbers as one with an axis, to read.

    NumPy's functions take it a third faster than a float, which they make an array of every time.

    Examples
    --------
    >>> constant(0.5) * np.array([2.0, 4.0])
    array([1., 2.])
    """
    array = np.array(value, np.float64)
    array.flags.writeable = False
    return array


def from_components(parts: Sequence[Number], dtype: DTypeLike = np.float64) -> NDArray[Any]:
    """Return the (B, k) array of k components."""
    if isinstance(parts[0], float):
        return np.array([parts], dtype)
    result = np.empty((len(parts[0]), len(parts)), dtype)
    for k, part in enumerate(parts):
        result[:, k] = part
    return result
