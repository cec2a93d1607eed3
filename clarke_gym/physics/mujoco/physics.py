"""MuJoCo physics: a batch of elastic robots with inertia, gravity and tendons that can go slack."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.kinematics import rotate
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Batch, as_batch
from clarke_gym.numerics.checks import check_choice, check_count, check_vector
from clarke_gym.numerics.linear_map import map_rows
from clarke_gym.physics.base import RobotState, hull_radius
from clarke_gym.physics.drives import Drives
from clarke_gym.physics.mujoco.displacements import Displacements
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.engines import make_engine
from clarke_gym.physics.mujoco.fields import OwnFields
from clarke_gym.physics.mujoco.folded import FoldedSteps
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.model import (
    DOWN_M_S2,
    PROFILES,
    build_chain,
    substeps,
)
from clarke_gym.physics.mujoco.possible import check_possible
from clarke_gym.physics.mujoco.rest import resting
from clarke_gym.physics.mujoco.scene import CONTACT_DT_S
from clarke_gym.physics.mujoco.tendons import TENDON_NUMBERS, TendonSprings
from clarke_gym.physics.mujoco.whole import WholeSteps
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.robot import Robot
from clarke_gym.robots.scene import EMPTY, Scene, Surroundings

STICKING = 0.9999
"""Impedance of tendons that stick: the largest that the engine takes."""

CREEP_1_KG = 0.5
"""Inverse mass by which the engine softens their friction: with its own the default robot's tendons
let go within half a second, with this one in seven minutes."""

_OF_TENDONS = (*TENDON_NUMBERS, "turn_rad")

MAX_JOINT_ANGLE_RAD = math.pi / 2  # a link folded further than this is no backbone any more


class MujocoPhysics:
    """A batch of robots simulated as serial chains of elastic hinges driven by tendons.

    The drives follow their commands with the robot's first-order lag, as in the constant-curvature
    physics, and ramp from one control step to the next. Tendons are springs with pretension that
    only pull. A segment's taut tendons act as two springs along its Clarke coordinates. Every step
    checks each tendon at each time step; a robot with a slack one repeats the control step with all
    its tendons. The engine decides which of those pull by the tension that it expects at the start
    of a time step, ahead by stiffness x speed x step; repeated steps are therefore made of shorter
    time steps (`Profile.slack_dt_s`). With straight-chord routing tendons are never folded, and
    their time step is that of the profile or `sim_dt_s`.

    Parameters
    ----------
    robot : Robot
    batch : Batch or int
        One robot or many; a number stands for that many.
    control_dt : float
        Control period [s].
    profile : {"fast", "accurate"}
    threads : int, optional
        Threads to step on; all cores, at most one a robot, by default. Results do not depend on it.
    sim_dt_s : float, optional
        Time step [s]; must divide the control period.
    routing : {"ideal", "chord"}
        Tendons parallel to the backbone, or straight from disk to disk.
    actuation : {"displacement", "tension"}
        Whether commands are tendon displacements [m] or tendon tensions [N].
    gravity_m_s2 : array_like, shape (3,)
        In the world frame.
    base_position_m : array_like, shape (3,)
        Position of the base in the world; states are in the frame of the base, see `to_world`.
    base_quaternion : array_like, shape (4,)
        Orientation (w, x, y, z) of the base in the world.
    payload_kg : float
        Point mass at the tip.
    scene : Scene
        Bodies around the robot, in the frame of its base. Contact is on only where there are any,
        between robot and scene: a robot does not touch itself.

    Raises
    ------
    ValueError
        If a choice is unknown, a number is impossible or `sim_dt_s` does not divide `control_dt`.

    Examples
    --------
    >>> physics = MujocoPhysics(Robot(), 1, 0.05)
    >>> physics.reset(np.array([0]), np.zeros((1, 1, 2)))
    >>> for _ in range(20):
    ...     physics.step(JointVector.from_clarke(np.array([[[0.005, 0.0]]])))
    >>> float(physics.state.displacement_vector.clarke[0, 0, 0].round(4))
    0.005
    """

    KEYWORDS: ClassVar[tuple[str, ...]] = ("profile", "sim_dt_s", "payload_kg", "threads")
    OFFERS: ClassVar[tuple[str, ...]] = (
        "tension",
        "velocity",
        "tip_velocity",
        "contact_force",
        "load",
    )

    displacement_bound = 1.25

    def __init__(
        self,
        robot: Robot,
        batch: Batch | int,
        control_dt: float,
        *,
        profile: str = "fast",
        threads: int | None = None,
        sim_dt_s: float | None = None,
        routing: str = "ideal",
        actuation: str = "displacement",
        gravity_m_s2: Sequence[float] = DOWN_M_S2,
        base_position_m: Sequence[float] = (0.0, 0.0, 0.0),
        base_quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        payload_kg: float = 0.0,
        scene: Scene = EMPTY,
    ) -> None:
        check_possible(robot, payload_kg)
        numbers = PROFILES[check_choice("profile", profile, tuple(PROFILES))]
        self.robot, self.batch = robot, as_batch(batch)
        self.surroundings = Surroundings(scene, self.batch.size, hull_radius(robot))
        longest = min(numbers.sim_dt_s, CONTACT_DT_S) if scene.bodies else numbers.sim_dt_s
        self._substeps = substeps(control_dt, sim_dt_s, longest)
        self._sim_dt = control_dt / self._substeps
        self._profile = numbers
        self._drives = Drives(robot, control_dt, limited=True)
        most = min(self.batch.size, os.cpu_count() or 1)
        self._threads = most if threads is None else check_count("threads", threads)
        self._options: dict[str, Any] = {
            "routing": routing,
            "actuation": actuation,
            "gravity_m_s2": gravity_m_s2,
            "base_quaternion": base_quaternion,
            "payload_kg": payload_kg,
            "scene": scene,
            "winding": False,
        }
        self._base = check_vector("base_position_m", base_position_m, 3), base_quaternion
        self._springs = TendonSprings(robot)
        self._force: FloatArray | None = None
        self._engine = self._make_engine(self._sim_dt)
        self._fields = OwnFields(self.chain.model, self.batch.size)
        self._tension_driven = actuation == "tension"
        self._begin_reading()
        self._drive = JointVector(self.batch.zeros(2 * robot.n_segments))
        self._set_diverged(np.zeros(self.batch.size, dtype=bool))
        self._touch: FloatArray | None = np.zeros(self.batch.size)
        self._state: RobotState | None = None
        start = np.zeros((self.batch.size, robot.n_segments, 2))
        self.reset(np.arange(self.batch.size), start)

    def _begin_reading(self) -> None:
        """Read displacements from the engine, and run control steps on it."""
        chord = self._options["routing"] == "chord"
        self._displacements = Displacements(self._engine, self._springs, self.batch, chord)
        self._steps = self._make_steps()

    def _set_diverged(self, diverged: NDArray[np.bool_]) -> None:
        self._diverged, self._stopped = diverged, int(diverged.sum())

    def _make_engine(self, sim_dt: float, folded: bool | None = None) -> Engine:
        """Return the robots' simulation, with their tendons folded or not."""
        chain = build_chain(
            self.robot,
            self._profile,
            sim_dt_s=sim_dt,
            folded=folded,
            record=self._substeps,
            **self._options,
        )
        return make_engine(chain, self.batch, self._threads, poses=folded is None)

    def _make_steps(self) -> FoldedSteps | WholeSteps:
        """Return what runs control steps."""
        springs, substeps = self._springs, self._substeps
        if not self.chain.folded:
            return WholeSteps(self._engine, springs, substeps, self._tension_driven)

        def make_whole() -> WholeSteps:
            finer = math.ceil(self._sim_dt / self._profile.slack_dt_s - 1e-9)
            engine = self._make_engine(self._sim_dt / finer, folded=False)
            self._equip(engine)
            return WholeSteps(engine, springs, substeps * finer)

        return FoldedSteps(self._engine, make_whole, springs, self._displacements, substeps)

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""
        if self._state is None:
            tip, quaternion = self._engine.tip_pose()
            displacement = self._displacements.achieved()
            self._state = RobotState(self, displacement, tip, quaternion, self._diverged)
        return self._state

    @property
    def chain(self) -> Chain:
        """The compiled model."""
        return self._engine.chain

    def to_world(self, points: FloatArray) -> FloatArray:
        """Return points of the base's frame in the world's.

        Parameters
        ----------
        points : ndarray, shape (..., 3)
            [m].

        Returns
        -------
        ndarray, shape (..., 3)
            [m].

        Examples
        --------
        >>> physics = MujocoPhysics(Robot(), 1, 0.05, base_position_m=(0.0, 0.0, 1.0),
        ...                         base_quaternion=(0.0, 1.0, 0.0, 0.0))  # hangs from above
        >>> physics.to_world(physics.state.tip_position).round(9) + 0.0
        array([[0. , 0. , 0.8]])
        """
        position, quaternion = self._base
        turned: FloatArray = rotate(np.asarray(quaternion, np.float64), points)
        return turned + position

    @property
    def tension(self) -> FloatArray:
        """Tension of every tendon [N], shape (B, N), from the current shape and drives."""
        command = self._drive.joint(self.robot)
        if self._tension_driven:
            return command
        return self._springs.tension(command, self.state.displacement)

    @property
    def velocity(self) -> FloatArray:
        """Rate of every tendon's displacement [m/s], shape (B, N), at the current state."""
        return self._displacements.rates()

    @property
    def tip_velocity(self) -> FloatArray:
        """Velocity of the tip [m/s], shape (B, 3), at the current state."""
        return self._engine.tip_velocity()

    @property
    def contact_force(self) -> FloatArray:
        """Magnitude of the net force between robot and scene [N], shape (B,), at the last step."""
        if self._touch is None:
            self._touch = self._steps.contact_force()
        return self._touch

    def rest(self, clarke: FloatArray) -> FloatArray:
        """Return the joint coordinates (R, nq) of unloaded robots at `clarke` (R, S, 2) [rad]."""
        joints = map_rows(self._springs.equilibrium(clarke), self.chain.shape.T)
        if self._own or self._tension_driven:
            return joints
        # With all tendons taut; those that would have to push are slack.
        told = map_rows(clarke.reshape(len(clarke), -1), self.robot.decoder.T)
        gap = told - map_rows(joints, self._displacements.jacobian(np.array([0]))[0].T)
        loose = ((self._springs.preload + gap < 0.0) & self._springs.pulls_only).any(1)
        if np.count_nonzero(loose):
            alike = np.zeros(np.count_nonzero(loose), np.intp)
            joints[loose] = self._own_rest(alike, clarke[loose])
        return joints

    @property
    def _own(self) -> bool:
        """Whether robots have numbers of their own on which it depends where they rest."""
        return self._springs.own or self._fields.varied("jnt_stiffness")

    def reset(
        self, rows: NDArray[np.intp], clarke: FloatArray, rest: FloatArray | None = None
    ) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2).

        Who knows `rest(clarke)` already may give it as `rest`.
        """
        driven = np.zeros_like(clarke) if self._tension_driven else clarke
        self._drive = self._drive.with_rows(self.batch, rows, driven)
        if self._stopped:
            diverged = self._diverged.copy()
            diverged[rows] = False
            self._set_diverged(diverged)
        if self.surroundings.scene.bodies:
            self._touch = self.contact_force.copy()
            self._touch[rows] = 0.0
        if self._own and not self._tension_driven:
            rest = self._own_rest(rows, clarke)
        self._engine.place(rows, self.rest(clarke) if rest is None else rest, 0.0)
        self._state = None

    def _own_rest(self, rows: NDArray[np.intp], clarke: FloatArray) -> FloatArray:
        """Return where robots with numbers of their own rest: joint coordinates (R, nq) [rad]."""
        command = map_rows(clarke.reshape(len(rows), -1), self.robot.decoder.T)
        stiffness, preload = self._springs.of(rows)
        return resting(
            command + preload,
            stiffness,
            self._springs.pulls_only,
            self._displacements.jacobian(rows),
            self._fields.of("jnt_stiffness", rows),
        )

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements.

        With the actuation "tension", `command` holds tensions [N] in the same two parts. Robots
        that have diverged stay where they were until they are reset.
        """
        stopped = self._stopped
        if stopped == self.batch.size:
            return
        start = self._drive
        if self._tension_driven:
            end = JointVector.from_state(self.batch, command.get_state())
        else:
            end = self._drives.approach(start, command)
        engine = self._engine
        engine.keep()
        self._steps.run(np.flatnonzero(~self._diverged) if stopped else None, start, end)
        broken = end.broken()  # MuJoCo would take 0 for what is no number
        # For one robot the sum of squares is mostly enough, for many one look at all joints while
        # nothing is wrong; nan fails all comparisons.
        small = engine.angle_norm() <= MAX_JOINT_ANGLE_RAD
        small = small or np.abs(engine.qpos).max() <= MAX_JOINT_ANGLE_RAD
        if stopped or broken is not None or not small:
            failed = np.logical_not((np.abs(engine.qpos) <= MAX_JOINT_ANGLE_RAD).all(1))
            end = self._stop(failed if broken is None else failed | broken, start, end)
        self._drive = end
        self._touch = self._state = None

    def _stop(self, failed: NDArray[np.bool_], start: JointVector, end: JointVector) -> JointVector:
        """Hold the robots that have diverged, now or earlier, and return where all drives are."""
        self._set_diverged(self._diverged | failed)
        still = np.flatnonzero(self._diverged)
        if not still.size:
            return end
        self._engine.place(still, self._engine.kept(still)[0], 0.0)
        return end.with_rows(self.batch, still, start.clarke[still])

    def place(self, rows: NDArray[np.intp], bodies: FloatArray) -> None:
        """Put the bodies around the robots `rows` to ends and radii (rows, K, 7) [m]."""
        self.surroundings.place(rows, bodies)
        for engine in self._engines():
            engine.put_bodies(rows, bodies, self.surroundings.scene.resized)
        self._state = None

    def pull(self, force: FloatArray) -> None:
        """Let forces (B, 3) [N] in the base frame act on the tips from now on."""
        self._force = force.copy()
        for engine in self._engines():
            engine.pull(force)

    def vary(self, rows: NDArray[np.intp], numbers: Mapping[str, FloatArray]) -> None:
        """Give the robots `rows` physical numbers of their own; see `Physics.vary`."""
        if "payload_kg" in numbers:
            own = self._options["payload_kg"]
            check_possible(self.robot, own + float(numbers["payload_kg"].max()))
        tendons = {name: numbers[name] for name in _OF_TENDONS if name in numbers}
        if tendons:
            self._vary_tendons(rows, tendons)
        for name, values in numbers.items():
            if name not in tendons:
                self._fields.vary(rows, name, values)
        for engine in self._engines():
            self._give_numbers(engine)
        self._state = None

    def _vary_tendons(self, rows: NDArray[np.intp], numbers: Mapping[str, FloatArray]) -> None:
        """Give the tendons of the robots `rows` numbers of their own."""
        if not self.chain.folded:
            raise ValueError(
                f"physics cannot vary {list(numbers)} of tendons that are not folded: routing, "
                f"actuation are {self._options['routing']!r}, {self._options['actuation']!r}"
            )
        if "turn_rad" in numbers and not self._options["winding"]:
            self._make_windable()
        self._springs.vary(self.batch.size, rows, numbers)
        if "turn_rad" in numbers:
            self._displacements.wind(rows, numbers["turn_rad"])

    def _make_windable(self) -> None:
        """Go on with a model whose tendons run along every joint that they pass."""
        before = self._engine
        self._options["winding"] = True
        self._engine = self._make_engine(self._sim_dt)
        self._equip(self._engine)
        self._engine.place(np.arange(self.batch.size), before.qpos, before.qvel, before.warm)
        self._begin_reading()

    def _give_numbers(self, engine: Engine) -> None:
        """Give simulations the numbers that robots have of their own."""
        self._fields.give(engine)
        springs, chain = self._springs, engine.chain
        if not springs.own:
            return
        gains = springs.gains(chain.folded)
        engine.model_field("actuator_gainprm")[:, :, 0] = gains
        engine.model_field("actuator_biasprm")[:, :, 1] = -gains
        wraps = self._displacements.wraps(chain)
        if wraps is not None:
            engine.model_field("wrap_prm")[:] = wraps
        if springs.friction is not None and not chain.folded:
            engine.model_field("tendon_solref_fri")[:] = 2.0 * chain.model.opt.timestep, 1.0
            engine.model_field("tendon_solimp_fri")[:, :, :2] = STICKING
            engine.model_field("tendon_invweight0")[:] = CREEP_1_KG

    def _equip(self, engine: Engine) -> None:
        """Give a new engine what was told to the others."""
        surroundings = self.surroundings
        if surroundings.scene.placed:
            rows = np.arange(self.batch.size)
            engine.put_bodies(rows, surroundings.numbers, surroundings.scene.resized)
        if self._force is not None:
            engine.pull(self._force)
        self._give_numbers(engine)

    def _engines(self) -> list[Engine]:
        """Return all simulations of the robots: with folded tendons, and with all of them."""
        return [self._engine, *self._steps.more_engines()]

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""
        ends = np.cumsum(self.robot.lengths)
        fractions = np.arange(1, points + 1) / points
        stations = [
            end - length * (1.0 - fractions)
            for end, length in zip(ends, self.robot.lengths, strict=True)
        ]
        return self._engine.points(np.concatenate([[0.0], *stations]))

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""
        return {
            "qpos": self._engine.qpos.copy(),
            "qvel": self._engine.qvel.copy(),
            "qacc_warmstart": self._engine.warm.copy(),
            "drive": self._drive.get_state(),
            "diverged": self._diverged.copy(),
            "contact_force": self.contact_force.copy(),
        }

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""
        rows = np.arange(self.batch.size)
        self._engine.place(rows, state["qpos"], state["qvel"], state["qacc_warmstart"])
        self._drive = JointVector.from_state(self.batch, state["drive"])
        self._set_diverged(state["diverged"].copy())
        self._touch = state.get("contact_force", np.zeros(self.batch.size)).copy()
        self._state = None
