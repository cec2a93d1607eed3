"""What lets one formula serve NumPy and torch arrays, and batches of any size bit for bit."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = Any
"""A NumPy array or a torch tensor; functions return the kind that they were given."""

FloatArray: TypeAlias = NDArray[np.float64]

ROW_BLOCK = 16


def namespace(*arrays: Array) -> ModuleType:
    """Return torch if any argument is a torch tensor, otherwise NumPy (torch is never imported)."""
    torch = sys.modules.get("torch")
    if torch is not None and any(isinstance(array, torch.Tensor) for array in arrays):
        return torch
    return np


def as_floating(array: Array, name: str) -> Array:
    """Return `array` as a floating-point array, keeping float32, float64 and torch tensors.

    Raises
    ------
    TypeError
        If `array` does not hold real numbers.
    """
    if namespace(array) is not np:
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


def map_rows(rows: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return ``rows @ matrix`` with each row's bits independent of how many rows there are.

    BLAS picks its kernel, hence its order of summation, by the shape of the product. Blocks of one
    fixed shape make a row of a batch equal the same row computed alone.

    Parameters
    ----------
    rows : ndarray, shape (B, k)
    matrix : ndarray, shape (k, m)
        Of the dtype of `rows`.

    Returns
    -------
    ndarray, shape (B, m)
    """
    count, width = rows.shape
    padding = -count % ROW_BLOCK
    if padding:
        padded = np.zeros((count + padding, width), rows.dtype)
        padded[:count] = rows
        rows = padded
    blocks = rows.reshape(-1, ROW_BLOCK, width) @ matrix
    return blocks.reshape(-1, matrix.shape[1])[:count]
