"""Control steps of robots with all their tendons."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.tendons import TendonSprings
from clarke_gym.robots.joint_vector import JointVector


class WholeSteps:
    """Runs robots whose tendons are all simulated.

    Parameters
    ----------
    engine : Engine
    springs : TendonSprings
    steps : int
        Time steps of a control step.
    tension_driven : bool
        Whether the drives give tensions [N] instead of displacements.
    """

    def __init__(
        self, engine: Engine, springs: TendonSprings, steps: int, tension_driven: bool = False
    ) -> None:
        self.engine = engine
        self._springs, self._steps, self._tension_driven = springs, steps, tension_driven
        self._duration = steps * engine.chain.model.opt.timestep

    def contact_force(self) -> FloatArray:
        """Return the net force between robot and scene in the last step [N], shape (B,)."""
        return self.engine.contact_force()

    def more_engines(self) -> list[Engine]:
        """Return no simulations beside the one that was given."""
        return []

    def run(self, rows: NDArray[np.intp] | None, start: JointVector, end: JointVector) -> None:
        """Advance the robots `rows` (None for all) by one control step.

        Parameters
        ----------
        rows : ndarray of int, or None
        start, end : JointVector
            The drives before and after.
        """
        springs = self._springs
        if self._tension_driven:
            tension = end.joint(springs.robot)
            tension = np.where(springs.pulls_only, np.maximum(tension, 0.0), tension)
            self.engine.run(rows, None, tension, self._steps)
            return
        first, last = (self.engine.straight + springs.lengths(drive) for drive in (start, end))
        rates = (last - first) / self._duration
        self.engine.run(rows, first, rates, self._steps)
