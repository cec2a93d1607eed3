"""One MuJoCo model, simulated as a batch or as one robot: time steps and fresh kinematics."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from struct import Struct
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray, Number, components
from clarke_gym.physics.links import Chain

_step, _step1, _step2 = mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2
_POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
_VELOCITIES = int(mujoco.mjtStage.mjSTAGE_VEL)


def _ignore_warning(_: str) -> None:
    """Drop an engine warning: whoever reads the state sees what is wrong with it."""


class QuietEngine:
    """Keep the engine from writing its warnings to a log file in the working directory."""

    def __enter__(self) -> None:
        """Take the engine's warnings."""
        self._previous = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(_ignore_warning)

    def __exit__(self, *_: object) -> None:
        """Give them back to whoever had them."""
        mujoco.set_mju_user_warning(self._previous)


class Engine(ABC):
    """B simulations of one chain.

    The model resets nothing by itself, so one that breaks down keeps joint coordinates that are
    huge or not a number.

    Parameters
    ----------
    chain : Chain
    """

    qpos: FloatArray
    """Joint coordinates [rad], shape (B, nq), to read; `place` writes them."""

    qvel: FloatArray
    """Their rates [rad/s], shape (B, nv)."""

    acted: FloatArray
    """Tendon lengths [m] at the start of each time step of the last control step, where the model
    records them, shape (B, ntendon, K)."""

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.straight = chain.model.tendon_length0.copy()
        self._tip = chain.model.site("tip").id

    def _name_history(self, history: FloatArray) -> None:
        """Name what the model's recorders write, (B, numbers).

        Each recorder has a ring of K samples: two numbers of its own, K times, K lengths. It is in
        order whenever K steps have been made since it was, as every call of `run` does.
        """
        recorders = self.chain.model.nsensor
        rings = history.reshape(len(history), recorders, -1) if recorders else history[:, :, None]
        self.acted = rings[:, :, 1 + rings.shape[2] // 2 :]

    def place(self, rows: NDArray[np.intp], qpos: FloatArray, qvel: FloatArray | float) -> None:
        """Put the simulations `rows` somewhere.

        Parameters
        ----------
        rows : ndarray of int, shape (R,)
        qpos : ndarray, shape (R, nq)
            Joint coordinates [rad].
        qvel : ndarray, shape (R, nv), or float
            Their rates [rad/s].
        """
        self.qpos[rows], self.qvel[rows] = qpos, qvel

    def angle_norm(self) -> float:
        """Return the root of the sum of squares of all joint coordinates [rad]; nan if one is."""
        return math.sqrt(np.vdot(self.qpos, self.qpos))

    def keep(self) -> None:
        """Remember where the simulations are, for `kept`."""
        self._kept = self.qpos.copy(), self.qvel.copy()

    def kept(self, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return joint coordinates and rates of the simulations `rows` at the last `keep`."""
        return self._kept[0][rows], self._kept[1][rows]

    @abstractmethod
    def run(
        self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int
    ) -> NDArray[np.bool_] | None:
        """Advance the simulations `rows` (None for all).

        Parameters
        ----------
        rows : ndarray of int or None
        start : ndarray, shape (B, nu), list of nu floats for a batch of one, or None
            Commanded tendon lengths at the start [m]; None with actuators that take tensions.
        control : ndarray, shape (B, nu), or list of nu floats
            Rate of the commanded lengths [m/s], or tensions [N].
        steps : int
            Time steps; a multiple of K where the model records the last K.

        Returns
        -------
        ndarray of bool, shape (B,), or None
            Simulations whose control holds what is no number; None for none. MuJoCo takes 0 for it.
        """

    @abstractmethod
    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tips' positions [m] and orientations (w, x, y, z)."""

    @abstractmethod
    def tendon_lengths(self) -> Any:
        """Return the lengths [m] of tendons that run along joints, once `tip_pose` was asked for.

        Returns
        -------
        ndarray, shape (B, ntendon), or list of ntendon floats for a robot by itself
        """

    @abstractmethod
    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        """Return outputs of the current state, shape (B, ...), after a stage of the engine."""

    def stretch(self) -> FloatArray:
        """Return how much longer each tendon is than on the straight robot [m], (B, ntendon)."""
        stretch: FloatArray = self._fresh(_POSITIONS, "ten_length")[0] - self.straight
        return stretch

    def stretch_rate(self) -> FloatArray:
        """Return the rate of `stretch` [m/s]."""
        return self._fresh(_VELOCITIES, "ten_velocity")[0].copy()

    def points(self, stations: FloatArray) -> FloatArray:
        """Return the points at some arc lengths of the backbone [m], shape (B, points, 3)."""
        positions, frames = self._fresh(_POSITIONS, "xpos", "xmat")
        bodies = np.searchsorted(self.chain.stations[1:], stations, side="right")
        bodies = np.minimum(bodies, len(self.chain.stations) - 1)
        tangents = frames.reshape(len(positions), -1, 3, 3)[..., 2][:, bodies]
        along = (stations - self.chain.stations[bodies])[:, None]
        curve: FloatArray = positions[:, bodies] + along * tangents
        return curve


class BatchEngine(Engine):
    """B simulations on some threads.

    Parameters
    ----------
    chain : Chain
    num_envs : int
        Batch size B.
    threads : int
        Threads to step on.
    """

    def __init__(self, chain: Chain, num_envs: int, threads: int) -> None:
        super().__init__(chain)
        self._batch = Batch(chain.model, num_envs, threads)
        self._quiet = QuietEngine()
        self.qpos, self.qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._control = self._batch.bind("ctrl")
        self._activation = self._batch.bind("act") if chain.model.na else None
        self._sites = self._batch.bind("site_xpos")
        self._quaternions = self._batch.bind("xquat")
        self._lengths = self._batch.bind("ten_length")
        self._name_history(self._batch.bind("history"))

    def run(
        self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int
    ) -> NDArray[np.bool_] | None:
        """Advance the simulations `rows`; see `Engine.run`."""
        if self._activation is not None:
            self._activation[:] = start
        self._control[:] = control
        with self._quiet:
            self._batch.step(rows, nstep=steps)
        if math.isfinite(np.vdot(control, control)):
            return None
        return np.logical_not(np.isfinite(control).all(1))

    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tips' positions [m] and orientations (w, x, y, z)."""
        self._batch.forward(stage=_POSITIONS)
        poses = self._sites[:, self._tip], self._quaternions[:, -1]
        return components(poses[0].copy(), False), components(poses[1].copy(), False)

    def tendon_lengths(self) -> FloatArray:
        """Return the lengths of tendons; see `Engine.tendon_lengths`."""
        return self._lengths

    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        outputs = [self._batch.bind(field) for field in fields]
        self._batch.forward(stage=stage)
        return outputs


class SingleEngine(Engine):
    """One simulation, with less overhead than a batch of one.

    A control step ends with the first half of the next time step, positions and velocities, so the
    fresh kinematics that states are read from cost nothing beside the time steps themselves.

    Parameters
    ----------
    chain : Chain
    """

    def __init__(self, chain: Chain) -> None:
        super().__init__(chain)
        self._model = chain.model
        self._data = data = mujoco.MjData(self._model)
        # Views into the simulator's memory, made once.
        self.qpos, self.qvel = data.qpos[None], data.qvel[None]
        self._angles, self._rates = data.qpos, data.qvel
        self._pack: Callable[..., None] = Struct(f"{self._model.nu}d").pack_into
        self._targets = memoryview(data.ctrl), memoryview(data.act)
        self._lengths = data.ten_length
        # MuJoCo reports the first warning of a kind alone, and would write it to a log file in the
        # working directory.
        data.warning.number[:] = 1
        self._tip_position, self._tip_quaternion = data.site_xpos[self._tip], data.xquat[-1]
        self._name_history(data.history[None])
        self._acted_later = self.acted[0, :, 1:]
        self._ready = False
        self._now: list[float] | None = None

    def place(self, rows: NDArray[np.intp], qpos: FloatArray, qvel: FloatArray | float) -> None:
        """Put the simulation somewhere; see `Engine.place`."""
        del rows
        self.qpos[:], self.qvel[:] = qpos, qvel
        self._ready, self._now = False, None

    def angle_norm(self) -> float:
        """Return the length of the vector of joint coordinates; see `Engine.angle_norm`."""
        return math.hypot(*self._angles.tolist())

    def keep(self) -> None:
        """Remember where the simulation is; see `Engine.keep`."""
        self._kept_bytes = self._angles.tobytes(), self._rates.tobytes()

    def kept(self, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        """Return where the simulation was; see `Engine.kept`."""
        del rows
        qpos, qvel = (np.frombuffer(part)[None] for part in self._kept_bytes)
        return qpos, qvel

    def _make_ready(self) -> None:
        """Do the first half of a time step, unless nothing has changed since it was done."""
        if not self._ready:
            _step1(self._model, self._data)
            self._ready = True

    def run(
        self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int
    ) -> NDArray[np.bool_] | None:
        """Advance the simulation, whichever `rows` says; see `Engine.run`."""
        del rows
        self._make_ready()
        if not isinstance(control, list):
            start, control = None if start is None else start[0].tolist(), control[0].tolist()
        if start is not None:
            self._pack(self._targets[1], 0, *start)
        self._pack(self._targets[0], 0, *control)
        model, data = self._model, self._data
        _step2(model, data)
        if steps > 1:
            _step(model, data, steps - 1)
        _step1(model, data)
        self._now = None
        return None if math.isfinite(sum(control)) else np.array([True])

    def tendon_lengths(self) -> list[float]:
        """Return the lengths of tendons; see `Engine.tendon_lengths`."""
        if self._now is None:
            self._make_ready()
            self._now = self._lengths.tolist()
        return self._now

    def lengths_meanwhile(self) -> list[list[float]]:
        """Return the lengths [m] between the time steps of the last control step, by tendon."""
        lengths: list[list[float]] = self._acted_later.tolist()
        return lengths

    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tip's position [m] and orientation (w, x, y, z)."""
        self._make_ready()
        return self._tip_position.tolist(), self._tip_quaternion.tolist()

    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        del stage  # both are done together
        self._make_ready()
        return [getattr(self._data, field)[None] for field in fields]
