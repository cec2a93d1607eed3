r"""What tendons do to a backbone: shape from tension, and straight tendons between disks.

Without external load a rod with straight parallel tendons bends with exactly constant curvature, so
the relations here agree with a Cosserat rod to rounding. A load at the tip or gravity is outside of
them. Derived here from the balance of the rod.
"""

from __future__ import annotations

import math

import numpy as np

from clarke_gym import kinematics
from clarke_gym.clarke.layouts import Layout
from clarke_gym.kinematics.arcs import angle_over_sine
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, as_floating, matrix_like
from clarke_gym.numerics.checks import check_pairs
from clarke_gym.numerics.linear_map import block_diagonal
from clarke_gym.robots.robot import Robot, Segment
from clarke_gym.robots.stiffness import axial_stiffness as axial_stiffness
from clarke_gym.robots.stiffness import bending_stiffness as bending_stiffness

STANDARD_GRAVITY_M_S2 = 9.80665

MOST_LOADS = 10.0
"""Heaviest load over E I / l^2, under which a backbone buckles."""

MOST_OWN_WEIGHT = 18.0
"""Heaviest disks and backbone over E I / (l l_s), with the robot's length l and that of its longest
segment l_s: simulated robots of one to three segments broke down from 19 on, none below 17."""


def most_payload_kg(robot: Robot) -> float:
    """Return the heaviest mass at the tip under which a robot can be simulated.

    Parameters
    ----------
    robot : Robot

    Returns
    -------
    float
        [kg]. Below 0 for a robot that is crushed without.

    Examples
    --------
    >>> round(most_payload_kg(Robot()), 3)
    0.258
    """
    softest = min(bending_stiffness(segment) for segment in robot.segments)
    disks_kg = sum(segment.n_disks * segment.disk_mass_kg for segment in robot.segments)
    backbone_kg = sum(
        0.25 * math.pi * s.backbone_diameter_m**2 * s.density_kg_m3 * s.length_m
        for s in robot.segments
    )
    bears_kg = softest / robot.length_m / STANDARD_GRAVITY_M_S2 / robot.lengths.max()
    own_kg = disks_kg + backbone_kg
    if own_kg > MOST_OWN_WEIGHT * bears_kg:
        return float(MOST_OWN_WEIGHT * bears_kg - own_kg)
    return float(MOST_LOADS * softest / robot.length_m**2 / STANDARD_GRAVITY_M_S2 - disks_kg)


def _tension_maps(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """Return the matrices from tensions (N,) to bending vectors (2S,) and axial strains (S,)."""
    count, starts = robot.n_segments, np.cumsum([0, *robot.n_tendons])
    levers = np.concatenate([s.matrices[1] * s.pitch_radius_m for s in robot.segments])
    bending, strain = np.zeros((2 * count, robot.n_joints)), np.zeros((count, robot.n_joints))
    for k, segment in enumerate(robot.segments):
        present = slice(starts[k], None)  # tendons that end here or further out
        scale = segment.length_m / bending_stiffness(segment)
        bending[2 * k : 2 * k + 2, present] = scale * levers[present].T
        strain[k, present] = -1.0 / axial_stiffness(segment)
    return bending, strain


def shape_from_tension(tension: Array, robot: Robot) -> tuple[Array, Array]:
    r"""Return bending vectors and compressed lengths under tendon tensions, no other load.

    :math:`(\kappa_x, \kappa_y)_k = \frac{1}{EI}\sum_i \tau_i d_i(\cos\psi_i, \sin\psi_i)` over the
    tendons present in segment k, :math:`\epsilon_k = -\sum_i\tau_i/EA`. For one symmetric segment
    this is :math:`\frac{nd}{2EI}M_P\tau`.

    Parameters
    ----------
    tension : array, shape (..., N)
        Tendon tensions [N], segment by segment from the base.
    robot : Robot

    Returns
    -------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    lengths : array, shape (..., S)
        Lengths (1 + epsilon) l [m].

    Raises
    ------
    TypeError, ValueError
        If `tension` is not real or its last axis is not N.

    Examples
    --------
    >>> bending, lengths = shape_from_tension(np.array([2.0, 0.0, 0.0]), Robot())
    >>> bending.round(3)
    array([[0.393, 0.   ]])
    """
    tension = _joints(tension, robot, "tension")
    to_bending, to_strain = _tension_maps(robot)
    bending = tension @ matrix_like(to_bending.T, tension)
    bending = bending.reshape(*bending.shape[:-1], robot.n_segments, 2)
    strain = tension @ matrix_like(to_strain.T, tension)
    return bending, matrix_like(robot.lengths, tension) * (1.0 + strain)


def displacement_from_tension(tension: Array, robot: Robot) -> Array:
    r"""Return tendon displacements under tensions, inextensible tendons and no other load.

    Bending and compression both shorten a tendon's path:
    :math:`\rho_i = d_i\beta\cdot u_i - l\epsilon`, summed over the segments it passes.

    Parameters
    ----------
    tension : array, shape (..., N)
        [N].
    robot : Robot

    Returns
    -------
    array, shape (..., N)
        rho [m].

    Raises
    ------
    TypeError, ValueError
        If `tension` is not real or its last axis is not N.

    Examples
    --------
    >>> displacement_from_tension(np.array([2.0, 2.0, 2.0]), Robot()).round(7)  # compression alone
    array([1.44e-05, 1.44e-05, 1.44e-05])
    """
    bending, lengths = shape_from_tension(tension, robot)
    xp = array_namespace(bending)
    clarke = kinematics.bending_to_clarke(bending, robot.pitch_radii)
    flat = clarke.reshape(*clarke.shape[:-2], 2 * robot.n_segments)
    shorter = xp.cumsum(matrix_like(robot.lengths, lengths) - lengths, -1)
    common = np.repeat(np.eye(robot.n_segments), robot.n_tendons, axis=1)
    return flat @ matrix_like(robot.decoder.T, flat) + shorter @ matrix_like(common, shorter)


def taut_gain(segment: Segment) -> float:
    r"""Return how much of a displacement bends a segment whose taut tendons stretch.

    :math:`\beta = g\,M_P\rho/d` with :math:`g = 1/(1 + 2EI/(n k_t d^2 l))`, the minimum of the
    elastic energy of backbone and tendons of stiffness k_t, for symmetric tendons.

    Parameters
    ----------
    segment : Segment

    Returns
    -------
    float
        g, below 1.

    Examples
    --------
    >>> round(taut_gain(Segment()), 4)
    0.9983
    """
    ratio = 2.0 * bending_stiffness(segment) / (segment.n_tendons * segment.tendon_stiffness_n_m)
    return 1.0 / (1.0 + ratio / (segment.pitch_radius_m**2 * segment.length_m))


def _disks(robot: Robot, like: Array) -> Array:
    counts = np.array([[float(segment.n_disks)] for segment in robot.segments])
    return matrix_like(counts, like)


def disk_displacements(bending: Array, robot: Robot) -> Array:
    r"""Return displacements of tendons that run straight from disk to disk.

    A chord under a bend :math:`\phi_s = \phi/N` is :math:`\mathrm{sinc}(\phi_s/2)` of its arc, so
    :math:`L_i = \mathrm{sinc}(\phi_s/2)(l - d_i\beta\cdot u_i)` in a segment of N disks. The mean
    of the displacements no longer vanishes: real displacements leave the manifold a little.

    Parameters
    ----------
    bending : array, shape (..., S, 2)
        Bending vectors [rad].
    robot : Robot

    Returns
    -------
    array, shape (..., N)
        rho [m].

    Raises
    ------
    TypeError, ValueError
        If `bending` is not real or has another shape.

    Examples
    --------
    >>> rho = disk_displacements(np.array([[1.0, 0.0]]), Robot())
    >>> (rho * 1e3).round(3)
    array([10.079, -4.915, -4.915])
    """
    bending = check_pairs(bending, robot.lengths, "bending")
    xp = array_namespace(bending)
    square = (bending * bending).sum(-1)[..., None]
    # sinc(t) with t = phi_s / 2 is 2 h at the bending angle phi_s.
    ratio = 2.0 * kinematics.half_angle_functions(square / _disks(robot, bending) ** 2)[1]
    clarke = kinematics.bending_to_clarke(ratio * bending, robot.pitch_radii)
    flat = clarke.reshape(*clarke.shape[:-2], 2 * robot.n_segments)
    shorter = xp.cumsum(matrix_like(robot.lengths, bending) * (1.0 - ratio[..., 0]), -1)
    common = np.repeat(np.eye(robot.n_segments), robot.n_tendons, axis=1)
    return flat @ matrix_like(robot.decoder.T, flat) + shorter @ matrix_like(common, shorter)


def bending_from_disk_displacements(rho: Array, robot: Robot) -> Array:
    r"""Return bending vectors from displacements of tendons straight between disks: closed form.

    Clarke coordinates give :math:`b = \mathrm{sinc}(\phi_s/2)\,\beta` for each segment, hence
    :math:`\sin(\phi_s/2) = |b|/(2N)` and :math:`\beta = b\,t/\sin t` with :math:`t = \phi_s/2`.
    What all tendons of a segment have in common, the chords' shortening, is no bend: it is fitted
    beside the Clarke coordinates, which feel it where tendons are not spaced evenly.

    Parameters
    ----------
    rho : array, shape (..., N)
        Displacements [m].
    robot : Robot

    Returns
    -------
    array, shape (..., S, 2)
        Bending vectors [rad].

    Raises
    ------
    TypeError, ValueError
        If `rho` is not real, its last axis is not N, or it asks for more than a half turn between
        two disks.

    Examples
    --------
    >>> rho = disk_displacements(np.array([[1.0, 0.5]]), Robot())
    >>> bending_from_disk_displacements(rho, Robot()).round(9)
    array([[1. , 0.5]])
    """
    rho = _joints(rho, robot, "rho")
    xp = array_namespace(rho)
    encoder = block_diagonal([_bend_alone(segment) for segment in robot.segments])
    clarke = rho @ matrix_like(encoder.T, rho)
    clarke = clarke.reshape(*clarke.shape[:-1], robot.n_segments, 2)
    chords = kinematics.clarke_to_bending(clarke, robot.pitch_radii)
    square = (chords * chords).sum(-1)[..., None] / (4.0 * _disks(robot, chords) ** 2)
    if bool((square >= 1.0).any()):
        raise ValueError("rho asks for more than a half turn between two disks")
    cosine = xp.sqrt(1.0 - square)
    return chords * angle_over_sine(square, cosine, square + cosine * cosine)


def _bend_alone(segment: Segment) -> FloatArray:
    """Return an encoder (2, n) that does not feel what all tendons have in common, if there is one.

    Of tendons on one line the bend and a common shortening cannot be told apart.
    """
    try:
        layout = Layout(segment.angles, segment.radii, segment.pitch_radius_m)
        return layout.extensible_encoder[:2]
    except ValueError:
        return segment.matrices[0]


def _joints(array: Array, robot: Robot, name: str) -> Array:
    array = as_floating(array, name)
    if array.ndim == 0 or array.shape[-1] != robot.n_joints:
        raise ValueError(
            f"{name} must have a last axis of {robot.n_joints}, got {tuple(array.shape)}"
        )
    return array
