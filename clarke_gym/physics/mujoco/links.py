"""The chain of links that stands for the backbones: bodies, hinges, rods and disks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import DISK_RIM_M
from clarke_gym.physics.mujoco.discretisation import joint_positions
from clarke_gym.physics.mujoco.tendons import tendon_offsets
from clarke_gym.robots.robot import Robot, Segment
from clarke_gym.robots.stiffness import bending_stiffness, torsional_stiffness

MIN_DAMPING_TIME_S = 1e-3


@dataclass(frozen=True)
class Chain:
    """A compiled model and what its joint coordinates mean.

    Parameters
    ----------
    model : mujoco.MjModel
    spec : mujoco.MjSpec
        What it was compiled from.
    bending_sum : ndarray, shape (2S, nq)
        Maps joint coordinates to the bending summed from the base to each segment's end [rad].
    shape : ndarray, shape (nq, 2S)
        Maps the segments' own bending vectors [rad] to joint coordinates of constant curvature.
    stations : ndarray, shape (nbody,)
        Arc length at the origin of each body [m]; bodies 0 and 1 are the world and the base.
    folded : bool
        Whether two tendons stand for the n taut ones of a segment.
    recorders : int
        Sensors that keep the tendons' lengths of some time steps.
    sensors : mapping of str to slice
        Where "tip_velocity" and, among bodies, "contact" write: three numbers each.
    scene_geoms : tuple of int
        Shapes of the bodies of the scene.
    """

    model: mujoco.MjModel
    spec: mujoco.MjSpec
    bending_sum: FloatArray
    shape: FloatArray
    stations: FloatArray
    folded: bool
    recorders: int = 0
    sensors: Mapping[str, slice] = field(default_factory=dict)
    scene_geoms: tuple[int, ...] = ()


class Backbone:
    """Adds base, links, hinges, disks and tip to a specification, from base to tip."""

    def __init__(
        self,
        spec: mujoco.MjSpec,
        robot: Robot,
        elements: int,
        step: float,
        routing: str,
        touches: bool = False,
    ) -> None:
        self._spec, self._robot = spec, robot
        self.hinges: list[list[tuple[str, str]]] = []  # (name, axis) of every hinge, per segment
        self._stations = [0.0, 0.0]
        body = spec.worldbody.add_body(name="base")
        start, origin = 0.0, 0.0
        radius = max(float(s.radii.max()) for s in robot.segments) + DISK_RIM_M
        for k, segment in enumerate(robot.segments):
            count = _element_count(segment, elements, routing)
            positions = joint_positions(segment.length_m, count)
            disks = segment.length_m * np.arange(1, segment.n_disks + 1) / segment.n_disks
            edges = np.concatenate([[0.0], positions, [segment.length_m]])
            self.hinges.append([])
            for i in range(len(edges) - 1):
                if i:
                    station = start + edges[i]
                    body = body.add_body(name=f"link{k}_{i}", pos=[0.0, 0.0, station - origin])
                    origin = station
                    self._stations.append(origin)
                    self._add_hinges(body, segment, count, i, k, step)
                last = i == len(edges) - 2
                ends = start + edges[i] - origin, start + edges[i + 1] - origin
                _add_rod(body, segment, *ends)
                if touches:
                    _add_hull(body, radius, *ends)
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
        spec.add_sensor(
            name="tip_velocity",
            type=mujoco.mjtSensor.mjSENS_FRAMELINVEL,
            objtype=mujoco.mjtObj.mjOBJ_SITE,
            objname="tip",
        )

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
        bending = bending_stiffness(segment) / piece
        twisting = torsional_stiffness(segment) / (2.0 * piece)
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
        recorders = int((model.sensor_type == int(mujoco.mjtSensor.mjSENS_TENDONPOS)).sum())
        places = {
            model.sensor(k).name: slice(model.sensor_adr[k], model.sensor_adr[k] + 3)
            for k in range(model.nsensor)
        }
        geoms = tuple(g for g in range(model.ngeom) if model.geom(g).name.startswith("scene"))
        stations = np.array(self._stations)
        return Chain(model, self._spec, total, shape, stations, folded, recorders, places, geoms)


def _element_count(segment: Segment, elements: int, routing: str) -> int:
    if routing == "ideal":
        return elements
    # Disks between elements stand perpendicular to the true tangent.
    return segment.n_disks * math.ceil(elements / segment.n_disks)


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
        contype=0,
        conaffinity=0,
    )


def _add_hull(body: mujoco.MjsBody, radius: float, begin: float, end: float) -> None:
    """Add what touches bodies of a scene: as wide as a disk, so that nothing slips between two."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        size=[radius, (end - begin) / 2.0, 0.0],
        pos=[0.0, 0.0, (begin + end) / 2.0],
        mass=0.0,
        group=4,
        contype=1,
        conaffinity=2,
    )


def _add_disk(body: mujoco.MjsBody, segment: Segment, z: float, radius: float) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, segment.disk_thickness_m / 2.0, 0.0],
        pos=[0.0, 0.0, z],
        mass=segment.disk_mass_kg,
        rgba=[0.8, 0.82, 0.85, 1.0],
        contype=0,
        conaffinity=0,
    )


def _add_holes(body: mujoco.MjsBody, robot: Robot, k: int, disk: int, z: float) -> None:
    for j in range(k, robot.n_segments):
        for i, (x, y) in enumerate(tendon_offsets(robot.segments[j])):
            body.add_site(name=f"hole{j}_{i}_{k}_{disk}", pos=[x, y, z], group=4)
