"""How far the simulated shapes take their tendons up."""

from __future__ import annotations

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Batch
from clarke_gym.numerics.linear_map import LinearMap, map_rows
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.tendons import TendonSprings
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

    to_clarke: FloatArray
    """Maps joint coordinates [rad] to Clarke coordinates [m] of parallel tendons, (nq, 2S)."""

    def __init__(self, engine: Engine, springs: TendonSprings, batch: Batch, chord: bool) -> None:
        robot, chain = springs.robot, engine.chain
        self._engine, self._robot, self._chord = engine, robot, chord
        self._batch = batch
        self.to_clarke = chain.bending_sum.T * np.repeat(robot.pitch_radii, 2)
        self._map = LinearMap(self.to_clarke)
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
        return JointVector(batch.components(self._map.of_rows(self._engine.qpos)))

    def rates(self) -> FloatArray:
        """Return the rates [m/s] of all tendons, shape (B, N)."""
        if self._chord:
            return -self._engine.stretch_rate()
        return map_rows(self._map.of_rows(self._engine.qvel), self._robot.decoder.T)
