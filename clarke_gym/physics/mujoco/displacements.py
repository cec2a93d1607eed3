"""How far the simulated shapes take their tendons up."""

from __future__ import annotations

import numpy as np

from clarke_gym.numerics.arrays import FloatArray, components
from clarke_gym.numerics.linear_map import LinearMap, map_rows
from clarke_gym.physics.base import JointVector
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.single_engine import SingleEngine
from clarke_gym.physics.mujoco.tendons import TendonSprings


class Displacements:
    """Reads tendon displacements and their rates from simulations.

    Parameters
    ----------
    engine : Engine
    springs : TendonSprings
    chord : bool
        Whether tendons run straight from disk to disk: their lengths depend on the shape in full.
    """

    to_clarke: FloatArray
    """Maps joint coordinates [rad] to Clarke coordinates [m] of parallel tendons, (nq, 2S)."""

    def __init__(self, engine: Engine, springs: TendonSprings, chord: bool) -> None:
        robot, chain = springs.robot, engine.chain
        self._engine, self._robot, self._chord = engine, robot, chord
        self._scalar = isinstance(engine, SingleEngine)
        self.to_clarke = chain.bending_sum.T * np.repeat(robot.pitch_radii, 2)
        self._map = LinearMap(self.to_clarke)
        self._axes_folded = chain.folded and springs.aligned

    def achieved(self) -> JointVector:
        """Return the displacements [m], once `Engine.tip_pose` was asked for."""
        if self._axes_folded:  # the virtual tendons shorten by just these numbers
            lengths = self._engine.tendon_lengths()
            if self._scalar:
                return JointVector([-length for length in lengths])
            return JointVector(components(-lengths, False))
        robot = self._robot
        if self._chord:
            rows = -self._engine.stretch()
            clarke = map_rows(rows, robot.encoder.T)
            off = rows - map_rows(clarke, robot.decoder.T)
            parts = components(clarke, self._scalar)
            return JointVector(parts, off[0].tolist() if self._scalar else off)
        if self._scalar:
            return JointVector(self._map.of_numbers(self._engine.qpos[0]).tolist())
        return JointVector(components(self._map.of_rows(self._engine.qpos), False))

    def rates(self) -> FloatArray:
        """Return the rates [m/s] of all tendons, shape (B, N)."""
        if self._chord:
            return -self._engine.stretch_rate()
        return map_rows(self._map.of_rows(self._engine.qvel), self._robot.decoder.T)
