"""Builds the MuJoCo model of a robot: a serial chain of hinges, disks and tendons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from clarke_gym._arrays import FloatArray
from clarke_gym.kinematics import rotate
from clarke_gym.physics.discretisation import joint_positions
from clarke_gym.physics.tendons import folded_axes, tendon_offsets
from clarke_gym.robots import Robot, Segment

STANDARD_GRAVITY_M_S2 = (0.0, 0.0, -9.80665)
ROUTINGS = ("ideal", "chord")
ACTUATIONS = ("displacement", "tension")
MIN_DAMPING_TIME_S = 1e-3
DISK_RIM_M = 1e-3  # how far a disk reaches beyond its outermost tendon hole


@dataclass(frozen=True)
class Profile:
    """What a simulation spends for its accuracy.

    Parameters
    ----------
    elements : int
        Elements of two bending joints and one twisting joint in each segment.
    sim_dt_s : float
        Longest time step [s].
    folded : bool
        Whether a segment's n taut tendons act as two tendons along its Clarke coordinates.
    tolerance : float
        Relative tolerance of the implicit step's equations.
    """

    elements: int
    sim_dt_s: float
    folded: bool
    tolerance: float = 1e-8


PROFILES = {
    "fast": Profile(elements=3, sim_dt_s=5e-3, folded=True, tolerance=1e-4),
    "accurate": Profile(elements=10, sim_dt_s=2e-3, folded=False, tolerance=1e-6),
}


@dataclass(frozen=True)
class Chain:
    """A compiled model and what its joint coordinates mean.

    Parameters
    ----------
    model : mujoco.MjModel
    bending_sum : ndarray, shape (2S, nq)
        Maps joint coordinates to the bending summed from the base to each segment's end [rad].
    shape : ndarray, shape (nq, 2S)
        Maps the segments' own bending vectors [rad] to joint coordinates of constant curvature.
    stations : ndarray, shape (nbody,)
        Arc length at the origin of each body [m]; bodies 0 and 1 are the world and the base.
    folded : bool
        Whether two tendons stand for the n taut ones of a segment.
    """

    model: mujoco.MjModel
    bending_sum: FloatArray
    shape: FloatArray
    stations: FloatArray
    folded: bool


def choice(name: str, value: str, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of the allowed names, or say which are."""
    if value not in allowed:
        raise ValueError(f"{name} must be one of {sorted(allowed)}, got {value!r}")
    return value


def finite_vector(name: str, value: Sequence[float] | FloatArray, size: int) -> FloatArray:
    """Return `value` as an array of `size` finite numbers, or raise."""
    array = np.asarray(value, dtype=np.float64)
    if array.shape != (size,) or not np.isfinite(array).all():
        raise ValueError(f"{name} must hold {size} finite numbers, got {value!r}")
    return array


def build_chain(
    robot: Robot,
    profile: Profile,
    *,
    sim_dt_s: float | None = None,
    folded: bool | None = None,
    routing: str = "ideal",
    actuation: str = "displacement",
    gravity_m_s2: Sequence[float] = STANDARD_GRAVITY_M_S2,
    base_quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    payload_kg: float = 0.0,
) -> Chain:
    """Return the compiled model of a robot, in the frame of its base.

    Parameters
    ----------
    robot : Robot
    profile : Profile
    sim_dt_s : float, optional
        Time step [s]; the profile's by default.
    folded : bool, optional
        Whether two tendons stand for the n taut ones of a segment; the profile's by default.
    routing : {"ideal", "chord"}
        Tendons parallel to the backbone, or straight from disk to disk (never folded).
    actuation : {"displacement", "tension"}
        What the tendons' actuators are given.
    gravity_m_s2 : array_like, shape (3,)
        In the world frame.
    base_quaternion : array_like, shape (4,)
        Orientation (w, x, y, z) of the base in the world.
    payload_kg : float
        Point mass at the tip.

    Returns
    -------
    Chain

    Raises
    ------
    ValueError
        If a choice is unknown or a number is impossible.

    Examples
    --------
    >>> chain = build_chain(Robot(), PROFILES["fast"])
    >>> chain.model.nv, chain.model.ntendon
    (15, 2)
    """
    choice("routing", routing, ROUTINGS)
    choice("actuation", actuation, ACTUATIONS)
    folded = profile.folded if folded is None else folded
    folded = folded and routing == "ideal" and actuation == "displacement"
    if not (math.isfinite(payload_kg) and payload_kg >= 0.0):
        raise ValueError(f"payload_kg must be finite and >= 0, got {payload_kg!r}")
    quaternion = finite_vector("base_quaternion", base_quaternion, 4)
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-6:
        raise ValueError(f"base_quaternion must have length 1, got {base_quaternion!r}")
    gravity = finite_vector("gravity_m_s2", gravity_m_s2, 3)
    step = profile.sim_dt_s if sim_dt_s is None else sim_dt_s

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = step
    spec.option.tolerance = profile.tolerance
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.gravity = rotate(quaternion * (1.0, -1.0, -1.0, -1.0), gravity)
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    chain = _Backbone(spec, robot, profile, step, routing)
    if payload_kg > 0.0:
        tip = spec.body(f"end{robot.n_segments - 1}")
        tip.mass, tip.inertia = payload_kg, [0.4 * payload_kg * DISK_RIM_M**2] * 3
    for j in range(robot.n_segments):
        if routing == "chord":
            _chord_tendons(spec, robot, j)
        else:
            _parallel_tendons(spec, robot, j, folded, chain.hinges)
        _actuators(spec, robot.segments[j], j, folded, actuation)
    return chain.compile(folded)


class _Backbone:
    """Adds base, links, hinges, disks and tip to a specification, from base to tip."""

    def __init__(
        self, spec: mujoco.MjSpec, robot: Robot, profile: Profile, step: float, routing: str
    ) -> None:
        self._spec, self._robot = spec, robot
        self.hinges: list[list[tuple[str, str]]] = []  # (name, axis) of every hinge, per segment
        self._stations = [0.0, 0.0]
        body = spec.worldbody.add_body(name="base")
        start, origin = 0.0, 0.0
        radius = max(float(s.radii.max()) for s in robot.segments) + DISK_RIM_M
        for k, segment in enumerate(robot.segments):
            elements = _element_count(segment, profile, routing)
            positions = joint_positions(segment.length_m, elements)
            disks = segment.length_m * np.arange(1, segment.n_disks + 1) / segment.n_disks
            edges = np.concatenate([[0.0], positions, [segment.length_m]])
            self.hinges.append([])
            for i in range(len(edges) - 1):
                if i:
                    station = start + edges[i]
                    body = body.add_body(name=f"link{k}_{i}", pos=[0.0, 0.0, station - origin])
                    origin = station
                    self._stations.append(origin)
                    self._add_hinges(body, segment, elements, i, k, step)
                last = i == len(edges) - 2
                _add_rod(body, segment, start + edges[i] - origin, start + edges[i + 1] - origin)
                inside = (disks > edges[i]) & ((disks <= edges[i + 1]) | last)
                for m in np.flatnonzero(inside):
                    z = float(start + disks[m] - origin)
                    _add_disk(body, segment, z, min(radius, _reach(robot, k)))
                    if routing == "chord":
                        _add_holes(body, robot, k, int(m), z)
            start += segment.length_m
            # A point at the segment's end, for poses, loads and payload.
            end = body.add_body(name=f"end{k}", pos=[0.0, 0.0, start - origin])
            # The compiler would put a massless body's centre elsewhere, and loads act on it.
            end.explicitinertial, end.ipos = True, [0.0, 0.0, 0.0]
            self._stations.append(start)
        if routing == "chord":
            _add_holes(spec.body("base"), robot, 0, -1, 0.0)
        end.add_site(name="tip")

    def _add_hinges(
        self,
        body: mujoco.MjsBody,
        segment: Segment,
        elements: int,
        i: int,
        k: int,
        step: float,
    ) -> None:
        # Mirrored orders x y | z y x: a product of rotations that is symmetric about the element's
        # middle has no twist of second order.
        piece = segment.length_m / (2 * elements)
        second_moment = math.pi * segment.backbone_diameter_m**4 / 64.0
        bending = segment.youngs_modulus_pa * second_moment / piece
        twisting = segment.shear_modulus_pa * 2.0 * second_moment / (2.0 * piece)
        # Backward Euler damps like an extra time constant of one step.
        tau = max(MIN_DAMPING_TIME_S, segment.damping_time_s - step)
        for axis in "xy" if i % 2 else "zyx":
            name = f"{axis}{k}_{i}"
            joint = body.add_joint(
                name=name,
                type=mujoco.mjtJoint.mjJNT_HINGE,
                axis=[float(axis == a) for a in "xyz"],
            )
            joint.stiffness[0] = twisting if axis == "z" else bending
            joint.damping[0] = tau * joint.stiffness[0]
            self.hinges[-1].append((name, axis))

    def compile(self, folded: bool) -> Chain:
        """Return the compiled model with its coordinate maps."""
        model = self._spec.compile()
        segments = self._robot.n_segments
        total = np.zeros((2 * segments, model.nq))
        shape = np.zeros((model.nq, 2 * segments))
        for k, hinges in enumerate(self.hinges):
            bending = [(name, axis) for name, axis in hinges if axis != "z"]
            share = 2.0 / len(bending)  # of the segment's length that one joint stands for
            for name, axis in bending:
                index = model.joint(name).qposadr[0]
                # A bend towards +x turns about +y, one towards +y about -x.
                column, sign = (0, 1.0) if axis == "y" else (1, -1.0)
                total[2 * k + column :: 2, index] = sign
                shape[index, 2 * k + column] = sign * share
        return Chain(model, total, shape, np.array(self._stations), folded)


def _element_count(segment: Segment, profile: Profile, routing: str) -> int:
    if routing == "ideal":
        return profile.elements
    # Disks between elements stand perpendicular to the true tangent.
    return segment.n_disks * math.ceil(profile.elements / segment.n_disks)


def _reach(robot: Robot, k: int) -> float:
    """Return the radius of disks that hold the tendons of segment k and of all beyond."""
    return max(float(segment.radii.max()) for segment in robot.segments[k:]) + DISK_RIM_M


def _add_rod(body: mujoco.MjsBody, segment: Segment, begin: float, end: float) -> None:
    radius = segment.backbone_diameter_m / 2.0
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, (end - begin) / 2.0, 0.0],
        pos=[0.0, 0.0, (begin + end) / 2.0],
        mass=segment.density_kg_m3 * math.pi * radius**2 * (end - begin),
        rgba=[0.25, 0.27, 0.3, 1.0],
    )


def _add_disk(body: mujoco.MjsBody, segment: Segment, z: float, radius: float) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, segment.disk_thickness_m / 2.0, 0.0],
        pos=[0.0, 0.0, z],
        mass=segment.disk_mass_kg,
        rgba=[0.8, 0.82, 0.85, 1.0],
    )


def _add_holes(body: mujoco.MjsBody, robot: Robot, k: int, disk: int, z: float) -> None:
    for j in range(k, robot.n_segments):
        for i, (x, y) in enumerate(tendon_offsets(robot.segments[j])):
            body.add_site(name=f"hole{j}_{i}_{k}_{disk}", pos=[x, y, z], group=4)


def _parallel_tendons(
    spec: mujoco.MjSpec, robot: Robot, j: int, folded: bool, hinges: list[list[tuple[str, str]]]
) -> None:
    segment = robot.segments[j]
    offsets = tendon_offsets(segment)
    if folded:
        offsets = segment.pitch_radius_m * folded_axes(segment)[1]
    for i, (x, y) in enumerate(offsets):
        tendon = spec.add_tendon(name=f"tendon{j}_{i}")
        for name, axis in (hinge for part in hinges[: j + 1] for hinge in part):
            # Bending towards a tendon shortens it by its offset times the angle.
            coefficient = {"x": y, "y": -x, "z": 0.0}[axis]
            if coefficient != 0.0:
                tendon.wrap_joint(name, coefficient)


def _chord_tendons(spec: mujoco.MjSpec, robot: Robot, j: int) -> None:
    for i in range(robot.segments[j].n_tendons):
        tendon = spec.add_tendon(name=f"tendon{j}_{i}", width=2e-4)
        tendon.wrap_site(f"hole{j}_{i}_0_-1")
        for k in range(j + 1):
            for m in range(robot.segments[k].n_disks):
                tendon.wrap_site(f"hole{j}_{i}_{k}_{m}")


def _actuators(spec: mujoco.MjSpec, segment: Segment, j: int, folded: bool, actuation: str) -> None:
    scales = folded_axes(segment)[0] if folded else np.ones(segment.n_tendons)
    for i, scale in enumerate(scales):
        actuator = spec.add_actuator(
            name=f"tendon{j}_{i}",
            target=f"tendon{j}_{i}",
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            ctrllimited=mujoco.mjtLimited.mjLIMITED_FALSE,
        )
        if actuation == "tension":
            actuator.set_to_motor()
            actuator.gainprm[0] = -1.0
            continue
        # Its activation is the commanded length, which ramps at the rate of its control; acting
        # early, it pulls by the length at the end of the step, as the implicit integrator does.
        actuator.set_to_intvelocity(kp=segment.tendon_stiffness_n_m * scale)
        actuator.actearly = True
        actuator.actlimited = mujoco.mjtLimited.mjLIMITED_FALSE
        if segment.joint_type == "tendon" and not folded:
            actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
            actuator.forcerange = [-1e9, 0.0]
