"""Many simulations of one MuJoCo model, on some threads."""

from __future__ import annotations

import os
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number
from clarke_gym.physics.mujoco.engine import NOTHING, POSITIONS, Engine
from clarke_gym.physics.mujoco.links import Chain


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


class BatchEngine(Engine):
    """B simulations on some threads.

    Parameters
    ----------
    chain : Chain
    num_envs : int
        Batch size B.
    threads : int
        Threads to step on.
    poses : bool
        Whether every step computes where the bodies are afterwards.
    """

    def __init__(self, chain: Chain, num_envs: int, threads: int, poses: bool = True) -> None:
        super().__init__(chain)
        self._stage = POSITIONS if poses else NOTHING
        self._batch = Batch(chain.model, num_envs, threads)
        self._process = os.getpid() if threads > 1 else None
        self._quiet = QuietEngine()
        self._own: dict[str, FloatArray] = {}
        self.qpos, self.qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self.warm = self._batch.bind("qacc_warmstart")
        self._control = self._batch.bind("ctrl")
        self._activation = self._batch.bind("act") if chain.model.na else None
        self._sites = self._batch.bind("site_xpos")
        self._quaternions = self._batch.bind("xquat")
        self._lengths = self._batch.bind("ten_length")
        self._sensors = self._batch.bind("sensordata")
        self.told = np.zeros_like(self._sensors)
        self._name_history(self._batch.bind("history"))
        self._stale = np.ones(num_envs, dtype=bool)  # where positions are not those of now

    def place(
        self,
        rows: NDArray[np.intp],
        qpos: FloatArray,
        qvel: FloatArray | float,
        warm: FloatArray | float = 0.0,
    ) -> None:
        """Put the simulations `rows` somewhere; see `Engine.place`."""
        super().place(rows, qpos, qvel, warm)
        self._stale[rows] = True

    def data(self, field: str) -> FloatArray:
        """Return an input of the simulations; see `Engine.data`."""
        return self._batch.bind(field)

    def model_field(self, field: str) -> FloatArray:
        """Return numbers of the models; see `Engine.model_field`."""
        if field not in self._own:
            self._own[field] = self._batch.expand(field)
        return self._own[field]

    def run(self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int) -> None:
        """Advance the simulations `rows`; see `Engine.run`."""
        if self._process is not None and self._process != os.getpid():
            raise RuntimeError(
                "a MuJoCo batch on several threads does not survive a fork; make the environment "
                "in the process that steps it, start processes with 'spawn', or pass threads=1"
            )
        if self._activation is not None:
            self._activation[:] = start
        self._control[:] = control
        with self._quiet:
            self._batch.step(rows, nstep=steps, stage=self._stage)
        stepped = slice(None) if rows is None else rows
        if "contact" in self.chain.sensors:  # a later stage by itself would overwrite forces
            self.told[stepped] = self._sensors[stepped]
        self._stale[stepped] = self._stage == NOTHING

    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tips' positions [m] and orientations (w, x, y, z)."""
        if np.count_nonzero(self._stale):
            self._batch.forward(np.flatnonzero(self._stale), stage=POSITIONS)
            self._stale[:] = False
        poses = self._sites[:, self._tip], self._quaternions[:, self._tip_body]
        return list(poses[0].T.copy()), list(poses[1].T.copy())

    def shortenings(self) -> list[Number]:
        """Return how far tendons are shorter than straight; see `Engine.shortenings`."""
        return list(np.ascontiguousarray(-self._lengths.T))

    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        outputs = [self._batch.bind(field) for field in fields]
        self._batch.forward(stage=stage)
        return outputs
