r"""Tendons that wind round the backbone instead of running parallel to it.

A tendon at :math:`R(\alpha)\,d_i u_i` where it has turned by alpha is shortened there, by a bend b,
as much as the parallel one by :math:`R(-\alpha) b`: all tendons of a segment turn alike, so their
displacements stay the decoder's of two numbers a segment, and two virtual tendons stand for them.
"""

from __future__ import annotations

import mujoco
import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.robots.robot import Robot


def turned(vectors: FloatArray, angle: FloatArray) -> FloatArray:
    """Return vectors of the plane turned by angles.

    Parameters
    ----------
    vectors : ndarray, shape (..., 2)
    angle : ndarray, shape (...)
        [rad].

    Returns
    -------
    ndarray, shape (..., 2)

    Examples
    --------
    >>> turned(np.array([1.0, 0.0]), np.pi / 2).round(6) + 0.0
    array([0., 1.])
    """
    x, y = vectors[..., 0], vectors[..., 1]
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def wound_maps(chain: Chain, robot: Robot, turn_rad: FloatArray) -> FloatArray:
    """Return the maps from joint coordinates to Clarke coordinates of wound tendons.

    Parameters
    ----------
    chain : Chain
    robot : Robot
    turn_rad : ndarray, shape (R,)
        What the tendons of each robot turn by along every segment [rad].

    Returns
    -------
    ndarray, shape (R, 2S, nq)
        [m/rad].

    Examples
    --------
    >>> from clarke_gym.physics.mujoco.model import PROFILES, build_chain
    >>> chain = build_chain(Robot(), PROFILES["fast"])
    >>> parallel, wound = wound_maps(chain, Robot(), np.array([0.0, np.pi]))
    >>> np.allclose(parallel, Robot().pitch_radii[0] * chain.bending_sum)
    True
    """
    starts = np.concatenate([[0.0], np.cumsum(robot.lengths)])
    stations = chain.stations[chain.model.jnt_bodyid]
    segment = np.searchsorted(starts[1:-1], stations, side="right")
    passed = segment + (stations - starts[segment]) / robot.lengths[segment]  # in segments
    bends = chain.bending_sum.reshape(robot.n_segments, 2, -1).transpose(0, 2, 1)
    angle = -turn_rad[:, None, None] * passed
    maps = robot.pitch_radii[:, None, None] * turned(bends, angle)
    return maps.transpose(0, 1, 3, 2).reshape(len(turn_rad), -1, chain.model.nq)


def wound_wraps(model: mujoco.MjModel, lengths: FloatArray) -> FloatArray:
    """Return the coefficients of tendons along joints, in the order of a model's wraps.

    Parameters
    ----------
    model : mujoco.MjModel
        Of which every tendon runs along every bending joint that it passes.
    lengths : ndarray, shape (R, ntendon, nq)
        Lengths of the tendons by joint coordinates [m/rad].

    Returns
    -------
    ndarray, shape (R, nwrap)

    Examples
    --------
    >>> from clarke_gym.physics.mujoco.model import PROFILES, build_chain
    >>> chain = build_chain(Robot(), PROFILES["fast"], folded=False, winding=True)
    >>> lengths = np.zeros((1, chain.model.ntendon, chain.model.nq))
    >>> wound_wraps(chain.model, lengths).shape == (1, chain.model.nwrap)
    True
    """
    tendon = np.repeat(np.arange(model.ntendon), model.tendon_num)
    return lengths[:, tendon, model.jnt_qposadr[model.wrap_objid]]
