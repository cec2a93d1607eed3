"""Builds the MuJoCo model of a robot: a serial chain of hinges, disks and tendons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from clarke_gym.kinematics import rotate
from clarke_gym.numerics.checks import (
    check_choice,
    check_not_negative,
    check_positive,
    check_vector,
)
from clarke_gym.physics.base import DISK_RIM_M
from clarke_gym.physics.mujoco.links import Backbone, Chain
from clarke_gym.physics.mujoco.scene import add_scene
from clarke_gym.physics.mujoco.tendons import folded_axes, tendon_offsets
from clarke_gym.physics.statics import STANDARD_GRAVITY_M_S2
from clarke_gym.robots.robot import Robot, Segment
from clarke_gym.robots.scene import EMPTY, Scene

DOWN_M_S2 = (0.0, 0.0, -STANDARD_GRAVITY_M_S2)
ROUTINGS = ("ideal", "chord")
ACTUATIONS = ("displacement", "tension")


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
    slack_dt_s : float
        Longest time step [s] of control steps that are repeated because a tendon goes slack. The
        engine lets a tendon go on the tension that it expects at the start of a time step, which is
        off by stiffness x speed x step: at full speed 1 N for the default robot, 3 N for three
        segments. Taut steps are implicit in the tension and need none of this.
    """

    elements: int
    sim_dt_s: float
    folded: bool
    tolerance: float = 1e-8
    slack_dt_s: float = 2.5e-4


PROFILES = {
    "fast": Profile(elements=3, sim_dt_s=5e-3, folded=True, tolerance=1e-4),
    "accurate": Profile(elements=10, sim_dt_s=2e-3, folded=True, tolerance=1e-6),
}


def substeps(control_dt: float, sim_dt: float | None, longest: float) -> int:
    """Return how many time steps make one control period.

    Parameters
    ----------
    control_dt : float
        Control period [s].
    sim_dt : float or None
        Time step [s], which must divide the control period; None for the longest that does.
    longest : float
        Longest time step where `sim_dt` is None [s].

    Returns
    -------
    int

    Raises
    ------
    ValueError
        If a time is not positive or `sim_dt` does not divide `control_dt`.

    Examples
    --------
    >>> substeps(0.05, None, 0.004), substeps(0.05, 0.01, 0.004)
    (13, 5)
    """
    for name, value in (("control_dt", control_dt), ("sim_dt_s", sim_dt)):
        if value is not None:
            check_positive(name, value)
    if sim_dt is None:
        return max(1, math.ceil(control_dt / longest - 1e-9))
    count = round(control_dt / sim_dt)
    if count < 1 or abs(count * sim_dt - control_dt) > 1e-9 * control_dt:
        raise ValueError(f"sim_dt_s={sim_dt!r} must divide the control period {control_dt!r} s")
    return count


def build_chain(
    robot: Robot,
    profile: Profile,
    *,
    sim_dt_s: float | None = None,
    folded: bool | None = None,
    routing: str = "ideal",
    actuation: str = "displacement",
    gravity_m_s2: Sequence[float] = DOWN_M_S2,
    base_quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
    payload_kg: float = 0.0,
    record: int = 0,
    scene: Scene = EMPTY,
    winding: bool = False,
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
    record : int
        Time steps of which the lengths of folded tendons are kept.
    scene : Scene
        Bodies in the frame of the base; contact is on only where there are any.
    winding : bool
        Whether tendons run along every bending joint, so that they can turn round the backbone.

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
    check_choice("routing", routing, ROUTINGS)
    check_choice("actuation", actuation, ACTUATIONS)
    folded = profile.folded if folded is None else folded
    folded = folded and routing == "ideal" and actuation == "displacement"
    check_not_negative("payload_kg", payload_kg)
    quaternion = check_vector("base_quaternion", base_quaternion, 4)
    if abs(np.linalg.norm(quaternion) - 1.0) > 1e-6:
        raise ValueError(f"base_quaternion must have length 1, got {base_quaternion!r}")
    gravity = check_vector("gravity_m_s2", gravity_m_s2, 3)
    step = profile.sim_dt_s if sim_dt_s is None else sim_dt_s

    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep = step
    spec.option.tolerance = profile.tolerance
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.gravity = rotate(quaternion * (1.0, -1.0, -1.0, -1.0), gravity)
    # Without auto-reset a simulation that breaks down shows it: its numbers stay huge or nan.
    disabled = [mujoco.mjtDisableBit.mjDSBL_AUTORESET]
    if not scene.bodies:
        disabled.append(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    if scene.resized:  # the tree of bounding boxes is that of the sizes at compilation
        disabled.append(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)
    spec.option.disableflags = sum(int(flag) for flag in disabled)
    touches = bool(scene.bodies)
    chain = Backbone(spec, robot, profile.elements, step, routing, touches)
    if touches:
        add_scene(spec, scene)
    if payload_kg > 0.0:
        tip = spec.body(f"end{robot.n_segments - 1}")
        tip.mass, tip.inertia = payload_kg, [0.4 * payload_kg * DISK_RIM_M**2] * 3
    for j in range(robot.n_segments):
        if routing == "chord":
            _chord_tendons(spec, robot, j)
        else:
            _parallel_tendons(spec, robot, j, folded, chain.hinges, winding)
        _actuators(spec, robot.segments[j], j, folded, actuation)
    if folded and record:
        _recorders(spec, record)
    return chain.compile(folded)


def _parallel_tendons(
    spec: mujoco.MjSpec,
    robot: Robot,
    j: int,
    folded: bool,
    hinges: list[list[tuple[str, str]]],
    winding: bool,
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
            if coefficient != 0.0 or (winding and axis != "z"):
                tendon.wrap_joint(name, coefficient)


def _chord_tendons(spec: mujoco.MjSpec, robot: Robot, j: int) -> None:
    for i in range(robot.segments[j].n_tendons):
        tendon = spec.add_tendon(name=f"tendon{j}_{i}", width=2e-4)
        tendon.wrap_site(f"hole{j}_{i}_0_-1")
        for k in range(j + 1):
            for m in range(robot.segments[k].n_disks):
                tendon.wrap_site(f"hole{j}_{i}_{k}_{m}")


def _recorders(spec: mujoco.MjSpec, steps: int) -> None:
    for tendon in spec.tendons:
        spec.add_sensor(
            name=tendon.name,
            type=mujoco.mjtSensor.mjSENS_TENDONPOS,
            objtype=mujoco.mjtObj.mjOBJ_TENDON,
            objname=tendon.name,
            nsample=steps,
        )


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
