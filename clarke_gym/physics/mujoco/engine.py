"""What the simulations of one MuJoCo model offer, many together or one by itself."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.scene import poses
from clarke_gym.physics.mujoco.tendons import TendonSprings

NOTHING = int(mujoco.mjtStage.mjSTAGE_NONE)
POSITIONS = int(mujoco.mjtStage.mjSTAGE_POS)
VELOCITIES = int(mujoco.mjtStage.mjSTAGE_VEL)


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

    warm: FloatArray
    """Accelerations of the last time step [rad/s^2], where the next one's solver starts and on
    which its last bits depend, shape (B, nv)."""

    acted: FloatArray
    """Tendon lengths [m] at the start of each time step of the last control step, where the model
    records them, shape (B, ntendon, K)."""

    told: FloatArray
    """What the model's sensors told in the last time step, shape (B, numbers)."""

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.straight = chain.model.tendon_length0.copy()
        self._tip = chain.model.site("tip").id
        self._tip_body = int(chain.model.site("tip").bodyid[0])

    def _name_history(self, history: FloatArray) -> None:
        """Name what the model's recorders write, (B, numbers).

        Each recorder has a ring of K samples: two numbers of its own, K times, K lengths. It is in
        order whenever K steps have been made since it was, as every call of `run` does.
        """
        recorders = self.chain.recorders
        rings = history.reshape(len(history), recorders, -1) if recorders else history[:, :, None]
        self.acted = rings[:, :, 1 + rings.shape[2] // 2 :]

    def place(
        self,
        rows: NDArray[np.intp],
        qpos: FloatArray,
        qvel: FloatArray | float,
        warm: FloatArray | float = 0.0,
    ) -> None:
        """Put the simulations `rows` somewhere.

        Nothing of what they did before is left: what follows depends on these numbers alone.

        Parameters
        ----------
        rows : ndarray of int, shape (R,)
        qpos : ndarray, shape (R, nq)
            Joint coordinates [rad].
        qvel : ndarray, shape (R, nv), or float
            Their rates [rad/s].
        warm : ndarray, shape (R, nv), or float
            Where the solver of the next time step starts [rad/s^2]; 0 as in a new simulation.
        """
        self.qpos[rows], self.qvel[rows], self.warm[rows] = qpos, qvel, warm

    @abstractmethod
    def data(self, field: str) -> FloatArray:
        """Return an input of the simulations by MuJoCo's name, (B, ...), to write to."""

    @abstractmethod
    def model_field(self, field: str) -> FloatArray:
        """Return numbers of the models by MuJoCo's name, (B, ...), to write to.

        Every simulation has its own from then on. What the compiler derived from the numbers
        stays: reference points and the softness of contacts do not move a robot.
        """

    def put_bodies(self, rows: NDArray[np.intp], bodies: FloatArray, resized: bool) -> None:
        """Put placed bodies of the scene somewhere.

        Parameters
        ----------
        rows : ndarray of int, shape (R,)
        bodies : ndarray, shape (R, K, 7)
            Ends of each axis and radius [m].
        resized : bool
            Whether radii and lengths are other ones than the model's.
        """
        position, quaternion, half = poses(bodies)
        self.data("mocap_pos")[rows], self.data("mocap_quat")[rows] = position, quaternion
        if resized:
            geoms = self.chain.scene_geoms
            size, reach = self.model_field("geom_size"), self.model_field("geom_rbound")
            box = self.model_field("geom_aabb")[:, :, 3:]  # what the engine looks for neighbours by
            for k, geom in enumerate(geoms):
                radius, end = bodies[:, k, 6], bodies[:, k, 6] + half[:, k]
                size[rows, geom, 0], size[rows, geom, 1] = radius, half[:, k]
                reach[rows, geom], box[rows, geom] = end, np.stack([radius, radius, end], axis=1)

    def pull(self, force: FloatArray) -> None:
        """Let forces (B, 3) [N] in the frame of the base act on the tips from now on."""
        self.data("xfrc_applied")[:, self._tip_body, :3] = force

    def angle_norm(self) -> float:
        """Return the root of the sum of squares of all joint coordinates [rad]; nan if one is."""
        return math.sqrt(np.vdot(self.qpos, self.qpos))

    def keep(self) -> None:
        """Remember where the simulations are, for `kept`."""
        self._kept = self.qpos.copy(), self.qvel.copy(), self.warm.copy()

    def kept(self, rows: NDArray[np.intp]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return where the simulations `rows` were at the last `keep`, as `place` takes it."""
        qpos, qvel, warm = self._kept
        return qpos[rows], qvel[rows], warm[rows]

    @abstractmethod
    def run(self, rows: NDArray[np.intp] | None, start: Any, control: Any, steps: int) -> None:
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
        """

    @abstractmethod
    def tip_pose(self) -> tuple[list[Number], list[Number]]:
        """Return the components of the tips' positions [m] and orientations (w, x, y, z)."""

    @abstractmethod
    def shortenings(self) -> list[Number]:
        """Return how far tendons that run along joints are shorter than straight [m].

        Once `tip_pose` was asked for; components, one a tendon.
        """

    def surely_taut(self, springs: TendonSprings, first: Any, last: Any) -> bool:
        """Return whether a quick look finds that no tendon can have gone slack in the last step.

        Parameters
        ----------
        springs : TendonSprings
        first, last : list of 2S floats, or ndarray
            Commanded lengths of the virtual tendons before and after [m].
        """
        del springs, first, last
        return False

    def contact_force(self) -> FloatArray:
        """Return the magnitude of the net force between robot and scene [N], shape (B,)."""
        place = self.chain.sensors.get("contact")
        if place is None:
            return np.zeros(len(self.qpos))
        force = self.told[:, place]
        size: FloatArray = np.linalg.norm(force, axis=1)
        return size

    def tip_velocity(self) -> FloatArray:
        """Return the velocities of the tips [m/s], shape (B, 3)."""
        place = self.chain.sensors["tip_velocity"]
        return self._fresh(VELOCITIES, "sensordata")[0][:, place].copy()

    @abstractmethod
    def _fresh(self, stage: int, *fields: str) -> list[FloatArray]:
        """Return outputs of the current state, shape (B, ...), after a stage of the engine."""

    def stretch(self) -> FloatArray:
        """Return how much longer each tendon is than on the straight robot [m], (B, ntendon)."""
        stretch: FloatArray = self._fresh(POSITIONS, "ten_length")[0] - self.straight
        return stretch

    def stretch_rate(self) -> FloatArray:
        """Return the rate of `stretch` [m/s]."""
        return self._fresh(VELOCITIES, "ten_velocity")[0].copy()

    def points(self, stations: FloatArray) -> FloatArray:
        """Return the points at some arc lengths of the backbone [m], shape (B, points, 3)."""
        positions, frames = self._fresh(POSITIONS, "xpos", "xmat")
        bodies = np.searchsorted(self.chain.stations[1:], stations, side="right")
        bodies = np.minimum(bodies, len(self.chain.stations) - 1)
        tangents = frames.reshape(len(positions), -1, 3, 3)[..., 2][:, bodies]
        along = (stations - self.chain.stations[bodies])[:, None]
        curve: FloatArray = positions[:, bodies] + along * tangents
        return curve
