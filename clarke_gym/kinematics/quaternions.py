"""Unit quaternions (w, x, y, z) of NumPy arrays and torch tensors, and by components."""

from __future__ import annotations

from clarke_gym.numerics.arrays import Array, Number, namespace

Components = tuple[Number, ...]
"""Coordinates of a vector or quaternion, each a float or an array."""


def quaternion_multiply(first: Array, second: Array) -> Array:
    """Return the Hamilton product of two arrays of quaternions (w, x, y, z).

    Parameters
    ----------
    first, second : array, shape (..., 4)

    Returns
    -------
    array, shape (..., 4)

    Examples
    --------
    >>> import numpy as np
    >>> quaternion_multiply(np.array([0.0, 1, 0, 0]), np.array([0.0, 0, 1, 0]))
    array([0., 0., 0., 1.])
    """
    xp = namespace(first, second)
    return xp.stack(product(split(first), split(second)), -1)


def rotate(quaternion: Array, vector: Array) -> Array:
    """Return `vector` turned by unit quaternions (w, x, y, z).

    Parameters
    ----------
    quaternion : array, shape (..., 4)
    vector : array, shape (..., 3)

    Returns
    -------
    array, shape (..., 3)

    Examples
    --------
    >>> import numpy as np
    >>> quarter_turn_about_z = np.sqrt([0.5, 0.0, 0.0, 0.5])
    >>> rotate(quarter_turn_about_z, np.array([1.0, 0.0, 0.0])).round(12) + 0.0
    array([0., 1., 0.])
    """
    xp = namespace(quaternion, vector)
    return xp.stack(turned(split(quaternion), split(vector)), -1)


def split(array: Array) -> Components:
    """Return the components along the last axis.

    Parameters
    ----------
    array : array, shape (..., k)

    Returns
    -------
    tuple of k arrays, shape (...)

    Examples
    --------
    >>> import numpy as np
    >>> split(np.array([[1.0, 2.0], [3.0, 4.0]]))[0]
    array([1., 3.])
    """
    return tuple(array[..., i] for i in range(array.shape[-1]))


def split_segments(array: Array) -> list[Array]:
    """Return the components of all segments, one after the other.

    Parameters
    ----------
    array : array, shape (..., S, 2)

    Returns
    -------
    list of 2S arrays, shape (...)

    Examples
    --------
    >>> import numpy as np
    >>> split_segments(np.array([[[1.0, 2.0], [3.0, 4.0]]]))[2]
    array([3.])
    """
    return [array[..., k, i] for k in range(array.shape[-2]) for i in (0, 1)]


def product(first: Components, second: Components) -> Components:
    """Return the Hamilton product by components.

    Parameters
    ----------
    first, second : tuple of 4
        (w, x, y, z), each a float or an array.

    Returns
    -------
    tuple of 4

    Examples
    --------
    >>> product((0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0))  # i j = k
    (0.0, 0.0, 0.0, 1.0)
    """
    a, b, c, d = first
    w, x, y, z = second
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def turned(quaternion: Components, vector: Components) -> Components:
    """Return `vector` turned by `quaternion`, by components.

    Parameters
    ----------
    quaternion : tuple of 4
        (w, x, y, z) of length 1, each a float or an array.
    vector : tuple of 3

    Returns
    -------
    tuple of 3

    Examples
    --------
    >>> turned((0.0, 0.0, 0.0, 1.0), (1.0, 2.0, 3.0))  # half a turn about z
    (-1.0, -2.0, 3.0)
    """
    w, a, b, c = quaternion
    x, y, z = vector
    tx, ty, tz = 2.0 * (b * z - c * y), 2.0 * (c * x - a * z), 2.0 * (a * y - b * x)
    return (
        x + w * tx + b * tz - c * ty,
        y + w * ty + c * tx - a * tz,
        z + w * tz + a * ty - b * tx,
    )


def rotation_rows(quaternion: Components) -> tuple[Components, Components, Components]:
    """Return the rows of the rotation matrix of a unit quaternion, by components.

    Parameters
    ----------
    quaternion : tuple of 4
        (w, x, y, z) of length 1, each a float or an array.

    Returns
    -------
    tuple of 3 tuples of 3

    Examples
    --------
    >>> rotation_rows((0.0, 0.0, 0.0, 1.0))[0]  # half a turn about z
    (-1.0, 0.0, 0.0)
    """
    w, x, y, z = quaternion
    a, b, c = x + x, y + y, z + z
    xx, yy, zz, xy, xz, yz = a * x, b * y, c * z, a * y, a * z, b * z
    wx, wy, wz = a * w, b * w, c * w
    return (
        (1.0 - (yy + zz), xy - wz, xz + wy),
        (xy + wz, 1.0 - (xx + zz), yz - wx),
        (xz - wy, yz + wx, 1.0 - (xx + yy)),
    )
