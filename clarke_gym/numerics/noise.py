"""Random numbers by counting: a function of a key and a place, with nothing to keep.

Noise of every step needs as many numbers as sensors have, for each environment from a stream of its
own. A hash of (key, place) gives all of them in a few array operations, the same bits for one
environment or many, and a checkpoint needs the key alone.

Source: SplitMix64, Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA
2014, section 4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clarke_gym.numerics.arrays import FloatArray

_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_SHIFTS = tuple(np.uint64(k) for k in (30, 27, 31, 11))


def _mixed(words: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Return SplitMix64's output for some states."""
    words = words + _STEP
    words = (words ^ (words >> _SHIFTS[0])) * _FIRST
    words = (words ^ (words >> _SHIFTS[1])) * _SECOND
    return words ^ (words >> _SHIFTS[2])


def uniforms(key: FloatArray, place: ArrayLike, size: int, stream: int = 0) -> FloatArray:
    """Return uniform numbers in (0, 1) that follow from keys and places alone.

    Parameters
    ----------
    key : ndarray, shape (B,)
        In [0, 1), one an environment and episode.
    place : array_like of int, shape (B,)
        Which of their steps.
    size : int
        Numbers a step.
    stream : int
        Numbers of different streams are independent.

    Returns
    -------
    ndarray, shape (B, size)

    Examples
    --------
    >>> uniforms(np.array([0.25, 0.5]), np.array([3, 3]), 2).round(3)
    array([[0.695, 0.334],
           [0.587, 0.549]])
    """
    words = (np.asarray(key, np.float64) * 2.0**53).astype(np.uint64)
    for counter in (np.full(len(words), stream), np.asarray(place)):
        words = _mixed(words ^ _mixed(counter.astype(np.uint64)))
    words = _mixed(words[:, None] + np.arange(size, dtype=np.uint64) * _STEP)
    numbers: FloatArray = ((words >> _SHIFTS[3]).astype(np.float64) + 0.5) * 2.0**-53
    return numbers


def normals(key: FloatArray, place: ArrayLike, size: int, stream: int = 0) -> FloatArray:
    """Return standard normal numbers that follow from keys and places alone.

    Parameters
    ----------
    key, place, size, stream
        As in `uniforms`.

    Returns
    -------
    ndarray, shape (B, size)
        By Box and Muller's formula.

    Examples
    --------
    >>> many = normals(np.full(1, 0.3), np.array([0]), 100_000)
    >>> bool(abs(many.mean()) < 0.01), bool(abs(many.std() - 1.0) < 0.01)
    (True, True)
    """
    half = (size + 1) // 2
    u = uniforms(key, place, 2 * half, stream)
    radius, angle = np.sqrt(-2.0 * np.log(u[:, :half])), 2.0 * np.pi * u[:, half:]
    pairs = np.concatenate([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    return pairs[:, :size]


def directions(numbers: FloatArray) -> FloatArray:
    """Return unit vectors that are uniform over the sphere.

    Parameters
    ----------
    numbers : ndarray, shape (..., 2)
        Uniform in [0, 1).

    Returns
    -------
    ndarray, shape (..., 3)

    Examples
    --------
    >>> directions(np.array([[0.5, 0.25]])).round(6) + 0.0
    array([[0., 1., 0.]])
    """
    height, angle = 2.0 * numbers[..., 0] - 1.0, 2.0 * np.pi * numbers[..., 1]
    flat = np.sqrt(1.0 - height**2)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), height], axis=-1)
