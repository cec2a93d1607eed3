"""Matrix products whose rows do not depend on how many rows there are, bit for bit.

BLAS picks its kernel, hence its order of summation, by the shape of the product. Blocks of one
fixed shape make a row of a batch equal the same row computed alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import add, mul, sub
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number

ROW_BLOCK = 64


def map_rows(rows: NDArray[Any], matrix: NDArray[Any]) -> NDArray[Any]:
    """Return ``rows @ matrix`` with each row's bits independent of how many rows there are.

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
    if count <= ROW_BLOCK:
        padded = np.zeros((ROW_BLOCK, width), rows.dtype)
        padded[:count] = rows
        return (padded @ matrix)[:count]
    padding = -count % ROW_BLOCK
    if padding:
        padded = np.zeros((count + padding, width), rows.dtype)
        padded[:count] = rows
        rows = padded
    blocks = rows.reshape(-1, ROW_BLOCK, width) @ matrix
    return blocks.reshape(-1, matrix.shape[1])[:count]


class LinearMap:
    """A matrix with buffers of its own, so that a single row costs little.

    Parameters
    ----------
    matrix : ndarray, shape (k, m)
        Its dtype is the precision of the results.
    columns : bool
        Whether batches come by columns (`of_columns`) instead of by rows (`of_rows`).

    Examples
    --------
    >>> double = LinearMap(2.0 * np.eye(2))
    >>> double.of_numbers([1.0, 2.0]), double.of_rows(np.array([[1.0, 2.0]]))
    (array([2., 4.]), array([[2., 4.]]))
    """

    def __init__(self, matrix: NDArray[Any], columns: bool = False) -> None:
        self.matrix = matrix
        self._columns = columns
        inner, outer = matrix.shape
        block = np.zeros((inner, ROW_BLOCK) if columns else (ROW_BLOCK, inner), matrix.dtype)
        self._block = block.T if columns else block
        self._row = self._block[0]
        self._product = np.empty((ROW_BLOCK, outer), matrix.dtype)
        self._first = self._product[0]

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the matrix alone: views do not stay views of their buffers."""
        return LinearMap, (self.matrix, self._columns)

    def of_numbers(self, numbers: Sequence[float] | NDArray[Any]) -> NDArray[Any]:
        """Return the product of one row of k numbers, shape (m,); valid until the next call."""
        self._row[:] = numbers
        np.dot(self._block, self.matrix, self._product)
        return self._first

    def of_rows(self, rows: NDArray[Any]) -> NDArray[Any]:
        """Return the products of rows (B, k), shape (B, m)."""
        return map_rows(rows, self.matrix)

    def of_columns(self, parts: Sequence[Number]) -> NDArray[Any]:
        """Return the products of rows given by their k columns of shape (B,), shape (B, m)."""
        count = len(parts[0])
        columns = np.zeros((len(parts), count + -count % ROW_BLOCK), self.matrix.dtype)
        for k, part in enumerate(parts):
            columns[k, :count] = part
        blocks = columns.reshape(len(parts), -1, ROW_BLOCK).transpose(1, 2, 0) @ self.matrix
        return blocks.reshape(-1, self.matrix.shape[1])[:count]


class AffineMap:
    """Components times a matrix, and added to an offset.

    Parameters
    ----------
    matrix : ndarray, shape (k, m)
    offset : ndarray, shape (m,), or (B, m) for an offset of each row

    Examples
    --------
    >>> AffineMap(-np.eye(2), np.ones(2)).of_components([0.25, 0.5])
    [0.75, 0.5]
    """

    def __init__(self, matrix: FloatArray, offset: FloatArray) -> None:
        self._map, self._offset = LinearMap(matrix, columns=True), offset
        self._offsets: list[float] = np.atleast_2d(offset)[0].tolist()
        self._mirrors = bool(
            matrix.shape[0] == matrix.shape[1] and (matrix == -np.eye(len(matrix))).all()
        )

    def of_components(self, parts: Sequence[Number]) -> Any:
        """Return a list of floats for one robot, or an array (B, m)."""
        if not isinstance(parts[0], float):
            return self._map.of_columns(parts) + self._offset
        if self._mirrors:  # the product below, to the bit
            return list(map(sub, self._offsets, parts))
        return list(map(add, self._map.of_numbers(parts).tolist(), self._offsets))


class DiagonalMap:
    """Components times a factor each: what a `LinearMap` with a diagonal matrix does, for less.

    Parameters
    ----------
    factors : list of float

    Examples
    --------
    >>> out = np.empty((1, 2), np.float32)
    >>> DiagonalMap([2.0, 3.0]).into([1.0, 1.0], out)
    >>> out
    array([[2., 3.]], dtype=float32)
    """

    def __init__(self, factors: list[float]) -> None:
        self._factors = factors

    def into(self, parts: Sequence[Number], out: NDArray[Any]) -> None:
        """Write the products of components into the columns of `out`, shape (B, k)."""
        if isinstance(parts[0], float):
            out[0] = list(map(mul, parts, self._factors))
            return
        for k, (part, factor) in enumerate(zip(parts, self._factors, strict=True)):
            out[:, k] = part * factor


def block_diagonal(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return the matrix with `blocks` along its diagonal and zeros elsewhere.

    Parameters
    ----------
    blocks : sequence of ndarray
        Matrices of any shapes.

    Returns
    -------
    ndarray

    Examples
    --------
    >>> block_diagonal([np.eye(1), np.full((1, 2), 3.0)])
    array([[1., 0., 0.],
           [0., 3., 3.]])
    """
    rows, columns = np.cumsum([(0, 0), *(block.shape for block in blocks)], axis=0).T
    result = np.zeros((rows[-1], columns[-1]))
    for k, block in enumerate(blocks):
        result[rows[k] : rows[k + 1], columns[k] : columns[k + 1]] = block
    return result
