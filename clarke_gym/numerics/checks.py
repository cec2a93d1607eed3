"""What arguments may be, and the errors that say so: which one, what was given, what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from clarke_gym.numerics.arrays import Array, FloatArray, as_floating

MIN_TENDONS = 3
MAX_TENDONS = 4096


def check_tendon_count(n: int, name: str = "n") -> int:
    """Return `n` as an int if it is a whole number of joints that spans a plane.

    Raises
    ------
    TypeError
        If `n` is not a whole number.
    ValueError
        If `n` < 3: two joints on one line cannot bend a segment in a plane of directions; or if it
        is beyond `MAX_TENDONS`.
    """
    if isinstance(n, bool) or not isinstance(n, int | np.integer):
        raise TypeError(f"{name} must be a whole number >= {MIN_TENDONS}, got {n!r}")
    if n < MIN_TENDONS:
        raise ValueError(f"{name} must be at least {MIN_TENDONS}, got {n}")
    if n > MAX_TENDONS:
        raise ValueError(
            f"{name} must be at most {MAX_TENDONS}, got {n}: matrices grow with its square"
        )
    return int(n)


def check_count(name: str, value: int, least: int = 1, most: int | None = None) -> int:
    """Return `value` if it is a whole number of at least `least`, and at most `most` if given."""
    whole = isinstance(value, int) and not isinstance(value, bool)
    if not whole or value < least or (most is not None and value > most):
        allowed = f">= {least}" if most is None else f"from {least} to {most}"
        raise ValueError(f"{name} must be a whole number {allowed}, got {value!r}")
    return value


def check_seeds(seed: int | Sequence[int | None] | None, size: int) -> list[int | None]:
    """Return the seed of each of `size` environments: seed + i, or a sequence's own entries.

    Raises
    ------
    ValueError
        If a sequence has another length.

    Examples
    --------
    >>> check_seeds(3, 2), check_seeds([1, None], 2), check_seeds(None, 2)
    ([3, 4], [1, None], [None, None])
    """
    if seed is None:
        return [None] * size
    if isinstance(seed, int | np.integer):
        return [int(seed) + i for i in range(size)]
    seeds = list(seed)
    if len(seeds) != size:
        raise ValueError(f"seed must hold {size} entries, got {len(seeds)}")
    return seeds


def is_positive(value: Any) -> bool:
    """Return whether something is a positive finite number."""
    number = isinstance(value, int | float | np.floating) and not isinstance(value, bool)
    return number and math.isfinite(value) and bool(value > 0.0)


def check_positive(name: str, value: float) -> float:
    """Return `value` as a float if it is a positive finite number."""
    if not is_positive(value):
        raise ValueError(f"{name} must be a positive finite number, got {value!r}")
    return float(value)


def check_not_negative(name: str, value: float) -> float:
    """Return `value` as a float if it is a finite number of at least 0."""
    number = isinstance(value, int | float | np.integer | np.floating)
    if isinstance(value, bool) or not (number and math.isfinite(value) and value >= 0.0):
        raise ValueError(f"{name} must be finite and >= 0, got {value!r}")
    return float(value)


def check_choice(name: str, value: str, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of the allowed names."""
    if value not in allowed:
        raise ValueError(f"{name} must be one of {list(allowed)}, got {value!r}")
    return value


def check_vector(name: str, value: Sequence[float] | FloatArray, size: int) -> FloatArray:
    """Return `value` as an array of `size` finite numbers."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must hold {size} finite numbers, got {value!r}")
    return array


def check_last_axis(array: Array, size: int, name: str) -> Array:
    """Return `array` as a floating array of shape (..., size)."""
    array = as_floating(array, name)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{name} must have a last axis of {size}, got shape {tuple(array.shape)}")
    return array


def check_pairs(pairs: Array, per_segment: Array, name: str) -> Array:
    """Return `pairs` as a floating array (..., S, 2) with S numbers in `per_segment`."""
    pairs = as_floating(pairs, name)
    count = getattr(per_segment, "shape", (len(per_segment),))[-1]
    if pairs.ndim < 2 or pairs.shape[-2:] != (count, 2):
        raise ValueError(
            f"{name} must have the shape (..., {count}, 2) for {count} segments, "
            f"got {tuple(pairs.shape)}"
        )
    return pairs
