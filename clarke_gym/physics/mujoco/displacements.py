"""How far the simulated shapes take their tendons up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Batch
from clarke_gym.numerics.linear_map import LinearMap, map_rows
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.tendons import TendonSprings
from clarke_gym.physics.mujoco.winding import wound_maps, wound_wraps
from clarke_gym.robots.joint_vector import JointVector


class Displacements:
    """Reads tendon displacements and their rates from simulations.

    Parameters
    ----------
    engine : Engine
    springs : TendonSprings
    batch : Batch
    chord : bool
        Whether tendons run straight from disk to disk: their lengths depend on the shape in full.
    """

    def __init__(self, engine: Engine, springs: TendonSprings, batch: Batch, chord: bool) -> None:
        robot, chain = springs.robot, engine.chain
        self._engine, self._robot, self._chord = engine, robot, chord
        self._batch, self._fold = batch, springs.fold
        to_clarke = chain.bending_sum.T * np.repeat(robot.pitch_radii, 2)
        self._map, self._to_folded = LinearMap(to_clarke), LinearMap(to_clarke @ springs.fold)
        self._wound: FloatArray | None = None
        self._shape = robot.n_joints, chain.model.nq
        self._axes_folded = chain.folded and springs.aligned

    def achieved(self) -> JointVector:
        """Return the displacements [m], once `Engine.tip_pose` was asked for."""
        if self._axes_folded:  # the virtual tendons shorten by just these numbers
            return JointVector(self._engine.shortenings())
        robot, batch = self._robot, self._batch
        if self._chord:
            rows = -self._engine.stretch()
            clarke = map_rows(rows, robot.encoder.T)
            off = rows - map_rows(clarke, robot.decoder.T)
            return JointVector(batch.components(clarke), batch.off_components(off))
        return JointVector(batch.components(self.clarke(self._engine.qpos)))

    def wind(self, rows: NDArray[np.intp], turn_rad: FloatArray) -> None:
        """Let the tendons of the robots `rows` turn round the backbone by (R,) a segment [rad]."""
        if self._wound is None:
            self._wound = np.tile(self._map.matrix.T, (self._batch.size, 1, 1))
        self._wound[rows] = wound_maps(self._engine.chain, self._robot, turn_rad)

    def clarke(self, joints: FloatArray, rows: NDArray[np.intp] | None = None) -> FloatArray:
        """Return the Clarke coordinates (R, 2S) [m] of joint coordinates or rates (R, nq)."""
        if self._wound is None:
            return self._map.of_rows(joints)
        clarke: FloatArray = np.matvec(self._wound[slice(None) if rows is None else rows], joints)
        return clarke

    def folded_lengths(self) -> FloatArray:
        """Return how far the shapes lengthen the virtual tendons [m], shape (B, 2S)."""
        if self._wound is None:
            return self._to_folded.of_rows(self._engine.qpos)
        return map_rows(self.clarke(self._engine.qpos), self._fold)

    def jacobian(self, rows: NDArray[np.intp]) -> FloatArray:
        """Return displacements by joint coordinates (R, N, nq) [m/rad] of the robots `rows`."""
        maps = self._map.matrix.T[None] if self._wound is None else self._wound[rows]
        return np.broadcast_to(self._robot.decoder @ maps, (len(rows), *self._shape))

    def wraps(self, chain: Chain) -> FloatArray | None:
        """Return coefficients (B, nwrap) of a model's tendons along joints, if any are wound."""
        if self._wound is None:
            return None
        matrix = self._fold.T if chain.folded else -self._robot.decoder
        return wound_wraps(chain.model, matrix @ self._wound)

    def rates(self) -> FloatArray:
        """Return the rates [m/s] of all tendons, shape (B, N)."""
        if self._chord:
            return -self._engine.stretch_rate()
        return map_rows(self.clarke(self._engine.qvel), self._robot.decoder.T)
