"""A batch of one MuJoCo model: runs rows for some time steps and reads fresh kinematics."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray, Number, components
from clarke_gym.physics.links import Chain

_POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
_VELOCITIES = int(mujoco.mjtStage.mjSTAGE_VEL)
_BAD_STATE = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
    int(mujoco.mjtWarning.mjWARN_BADCTRL),
]


def _ignore_warning(_: str) -> None:
    """Drop an engine warning: the batch counts them and the caller reports them."""


class QuietEngine:
    """Keep the engine from writing its warnings to a log file in the working directory."""

    def __enter__(self) -> None:
        """Take the engine's warnings."""
        self._previous = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(_ignore_warning)

    def __exit__(self, *_: object) -> None:
        """Give them back to whoever had them."""
        mujoco.set_mju_user_warning(self._previous)


class Engine:
    """B simulations of one chain.

    Parameters
    ----------
    chain : Chain
    num_envs : int
        Batch size B.
    threads : int
        Threads to step on.
    """

    def __init__(self, chain: Chain, num_envs: int, threads: int) -> None:
        self.chain = chain
        model = chain.model
        self._batch = Batch(model, num_envs, threads)
        self.qpos, self.qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self._control = self._batch.bind("ctrl")
        self._activation = self._batch.bind("act") if model.na else None
        self._sites = self._batch.bind("site_xpos")
        self._quaternions = self._batch.bind("xquat")
        self._lengths = self._batch.bind("ten_length")
        self._timestep = model.opt.timestep
        self._tip = model.site("tip").id
        self._counts = self._batch.warning[:, :, 1]
        self._warned, self._warnings_seen = self._warnings(), self._counts.tobytes()
        self.straight = model.tendon_length0.copy()
        self._record = np.zeros((num_envs, 0, model.ntendon))

    def _warnings(self) -> NDArray[np.intp]:
        counts: NDArray[np.intp] = self._counts[:, _BAD_STATE].sum(1)
        return counts

    def run(
        self,
        rows: NDArray[np.intp] | None,
        start: FloatArray,
        end: FloatArray,
        steps: int,
        record: bool,
    ) -> tuple[NDArray[np.bool_], FloatArray | None]:
        """Advance the simulations `rows` (None for all) under ramped actuators.

        Parameters
        ----------
        rows : ndarray of int or None
        start, end : ndarray, shape (B, nu)
            Commanded tendon lengths [m] before and after, or tensions [N], of which only the end
            counts.
        steps : int
            Time steps K.
        record : bool
            Whether to return the tendon lengths of every time step.

        Returns
        -------
        failed : ndarray of bool, shape (B,)
            Simulations that the engine gave up.
        lengths : ndarray, shape (rows, K, ntendon), or None
            The tendon lengths that acted in each time step.
        """
        if self._activation is None:
            self._control[:] = end
        else:
            self._activation[:] = start
            self._control[:] = (end - start) / (steps * self._timestep)
        lengths = None
        with QuietEngine():
            if not record:
                self._batch.step(rows, nstep=steps)
            elif rows is None:
                if self._record.shape[1] != steps:
                    self._record = np.zeros((len(self.qpos), steps, self.chain.model.ntendon))
                lengths = self._record
                self._batch.rollout(steps, record=("ten_length",), out={"ten_length": lengths})
            else:
                out = self._batch.rollout(steps, record=("ten_length",), ids=rows)
                lengths = out["ten_length"]
        failed = np.zeros(len(self.qpos), dtype=bool)
        seen = self._counts.tobytes()
        if seen != self._warnings_seen:
            warned = self._warnings()
            failed = warned != self._warned
            self._warned, self._warnings_seen = warned, seen
        return failed, lengths

    def refresh(self) -> None:
        """Bring kinematics and tendon lengths up to the current joint coordinates."""
        self._batch.forward(stage=_POSITIONS)

    def tip_pose(self, scalar: bool) -> tuple[list[Number], list[Number]]:
        """Return the components of the tips' positions [m] and orientations (w, x, y, z)."""
        if scalar:
            return self._sites[0, self._tip].tolist(), self._quaternions[0, -1].tolist()
        poses = self._sites[:, self._tip], self._quaternions[:, -1]
        return components(poses[0].copy(), False), components(poses[1].copy(), False)

    def stretch(self) -> FloatArray:
        """Return how much longer each tendon is than on the straight robot [m], (B, ntendon)."""
        stretch: FloatArray = self._lengths - self.straight
        return stretch

    def stretch_rate(self) -> FloatArray:
        """Return the rate of `stretch` [m/s]."""
        rates = self._batch.bind("ten_velocity")
        self._batch.forward(stage=_VELOCITIES)
        return rates.copy()

    def points(self, stations: FloatArray) -> FloatArray:
        """Return the points at some arc lengths of the backbone [m], shape (B, points, 3)."""
        positions, frames = self._batch.bind("xpos"), self._batch.bind("xmat")
        self._batch.forward(stage=_POSITIONS)
        bodies = np.searchsorted(self.chain.stations[1:], stations, side="right")
        bodies = np.minimum(bodies, len(self.chain.stations) - 1)
        tangents = frames.reshape(len(positions), -1, 3, 3)[..., 2][:, bodies]
        along = (stations - self.chain.stations[bodies])[:, None]
        curve: FloatArray = positions[:, bodies] + along * tangents
        return curve
