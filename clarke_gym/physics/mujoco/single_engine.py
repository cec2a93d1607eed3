"""One simulation of a MuJoCo model, with less overhead than a batch of one."""

from __future__ import annotations

import math
from collections.abc import Callable
from struct import Struct
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.tendons import TendonSprings

_step, _step1, _step2 = mujoco.mj_step, mujoco.mj_step1, mujoco.mj_step2


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
        self.warm = data.qacc_warmstart[None]
        self._angles, self._rates, self._start = data.qpos, data.qvel, data.qacc_warmstart
        self._pack: Callable[..., None] = Struct(f"{self._model.nu}d").pack_into
        self._targets = memoryview(data.ctrl), memoryview(data.act)
        self._lengths = data.ten_length
        self.told = data.sensordata[None]
        # Of each kind of warning MuJoCo writes the first to a log file in the working directory and
        # only counts the rest: as if there had been one, it stays quiet.
        data.warning.number[:] = 1
        self._tip_position = data.site_xpos[self._tip]
        self._tip_quaternion = data.xquat[self._tip_body]
        self._name_history(data.history[None])
        self._acted_later = self.acted[0, :, 1:]
        self._begin_step()

    def place(
        self,
        rows: NDArray[np.intp],
        qpos: FloatArray,
        qvel: FloatArray | float,
        warm: FloatArray | float = 0.0,
    ) -> None:
        """Put the simulation somewhere; see `Engine.place`."""
        del rows
        self.qpos[:], self.qvel[:], self.warm[:] = qpos, qvel, warm
        self._begin_step()

    def data(self, field: str) -> FloatArray:
        """Return an input of the simulation; see `Engine.data`."""
        return getattr(self._data, field)[None]

    def model_field(self, field: str) -> FloatArray:
        """Return numbers of the model; see `Engine.model_field`."""
        owner = self._model.opt if field.startswith("opt.") else self._model
        return getattr(owner, field.removeprefix("opt."))[None]

    def put_bodies(self, rows: NDArray[np.intp], bodies: FloatArray, resized: bool) -> None:
        """Put placed bodies of the scene somewhere; see `Engine.put_bodies`."""
        super().put_bodies(rows, bodies, resized)
        self._begin_step()  # with the contacts that there are now

    def angle_norm(self) -> float:
        """Return the length of the vector of joint coordinates; see `Engine.angle_norm`."""
        return math.hypot(*self._angles.tolist())

    def keep(self) -> None:
        """Remember where the simulation is; see `Engine.keep`."""
        self._kept_bytes = self._angles.tobytes(), self._rates.tobytes(), self._start.tobytes()

    def kept(self, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where the simulation was; see `Engine.kept`."""
        del rows
        qpos, qvel, warm = (np.frombuffer(part)[None] for part in self._kept_bytes)
        return qpos, qvel, warm

    def _begin_step(self) -> None:
        """Do the first half of a time step: what follows from where the simulation is."""
        _step1(self._model, self._data)
        self._now: list[float] = self._lengths.tolist()

    def run(self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int) -> None:
        """Advance the simulation, whichever `rows` says; see `Engine.run`."""
        del rows
        if not isinstance(control, list):
            start, control = None if start is None else start[0].tolist(), control[0].tolist()
        if start is not None:
            self._pack(self._targets[1], 0, *start)
        self._pack(self._targets[0], 0, *control)
        model, data = self._model, self._data
        _step2(model, data)
        if steps > 1:
            _step(model, data, steps - 1)
        self._begin_step()

    def shortenings(self) -> list[Number]:
        """Return how far tendons are shorter than straight; see `Engine.shortenings`."""
        return [-length for length in self._now]

    def surely_taut(self, springs: TendonSprings, first: list[float], last: list[float]) -> bool:
        """Return whether no tendon can have gone slack; see `Engine.surely_taut`."""
        meanwhile: list[list[float]] = self._acted_later.tolist()
        return springs.surely_taut(first, last, meanwhile, self._now)

    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tip's position [m] and orientation (w, x, y, z)."""
        return self._tip_position.tolist(), self._tip_quaternion.tolist()

    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        del stage  # both are done together
        return [getattr(self._data, field)[None] for field in fields]
