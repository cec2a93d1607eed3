"""Control steps with folded tendons, repeated with all tendons where one of them goes slack."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import array_of, slope
from clarke_gym.numerics.linear_map import map_rows
from clarke_gym.physics.mujoco.displacements import Displacements
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.tendons import TendonSprings
from clarke_gym.physics.mujoco.whole import WholeSteps
from clarke_gym.robots.joint_vector import JointVector

Motion: TypeAlias = tuple[JointVector, JointVector]
"""Where the drives are before and after a control step."""


class FoldedSteps:
    """Runs robots whose taut tendons are folded into two a segment.

    Every tendon is checked at each time step. A robot with a slack one goes back to where it was
    at the engine's last `keep` and repeats the control step with all its tendons, in time steps of
    their own.

    Parameters
    ----------
    engine : Engine
        The robots with folded tendons.
    make_whole : callable
        Makes what runs the same robots with all their tendons, once it is needed.
    springs : TendonSprings
    displacements : Displacements
    steps : int
        Time steps K of a control step.
    """

    def __init__(
        self,
        engine: Engine,
        make_whole: Callable[[], WholeSteps],
        springs: TendonSprings,
        displacements: Displacements,
        steps: int,
    ) -> None:
        self._engine, self._springs, self._steps = engine, springs, steps
        self._duration = steps * engine.chain.model.opt.timestep
        self._make_whole = make_whole
        self._watch_slack = bool(springs.pulls_only.any())
        self._displacements = displacements
        self._ramp = (np.arange(1, steps + 1) / steps)[:, None]
        self._repeated = np.zeros(len(engine.qpos), dtype=bool)
        self._held: tuple[JointVector, Any] | None = None

    @cached_property
    def _whole(self) -> WholeSteps:
        return self._make_whole()

    def contact_force(self) -> FloatArray:
        """Return the net force between robot and scene in the last step [N], shape (B,)."""
        force = self._engine.contact_force()
        if np.count_nonzero(self._repeated):
            whole = self._whole.engine.contact_force()
            force = np.where(self._repeated, whole, force)
        return force

    def more_engines(self) -> list[Engine]:
        """Return the simulations with all tendons, where they were needed already."""
        return [self._whole.engine] if "_whole" in self.__dict__ else []

    def run(self, rows: NDArray[np.intp] | None, start: JointVector, end: JointVector) -> None:
        """Advance the robots `rows` (None for all) by one control step.

        Parameters
        ----------
        rows : ndarray of int, or None
        start, end : JointVector
            The drives before and after.
        """
        self._repeated[:] = False
        first, last = self._lengths(start), self._springs.folded_lengths(end)
        self._held = end, last
        rates = slope(first, last, self._duration)
        whole = self._surely_whole(start, first)
        if whole is not None and np.count_nonzero(whole):
            rows = np.arange(len(whole)) if rows is None else rows
            self._run_whole(rows[whole[rows]], (start, end))
            rows = rows[~whole[rows]]
            if not rows.size:
                return
        self._engine.run(rows, first, rates, self._steps)
        if not self._watch_slack:
            return
        taut = start.off_manifold is None and end.off_manifold is None
        if taut and self._engine.surely_taut(self._springs, first, last):
            return
        slack = self._went_slack(rows, (start, end), np.atleast_2d(first), np.atleast_2d(last))
        if np.count_nonzero(slack):
            self._run_whole(np.flatnonzero(slack) if rows is None else rows[slack], (start, end))

    def _surely_whole(self, start: JointVector, first: Any) -> NDArray[np.bool_] | None:
        """Return which robots need not be tried with folded tendons first, if any is known."""
        unfolded = self._springs.unfolded
        if start.off_manifold is None or not self._watch_slack:
            return unfolded
        gap = self._displacements.folded_lengths() - np.atleast_2d(first)
        # A robot with nothing off the manifold does not depend on what its neighbours have there.
        loose = array_of(start.off_manifold).any(1)
        loose &= self._springs.slack(start, start, gap[:, None])
        return loose if unfolded is None else loose | unfolded

    def _went_slack(
        self, rows: NDArray[np.intp] | None, drives: Motion, first: FloatArray, last: FloatArray
    ) -> NDArray[np.bool_]:
        """Return which of some robots had a slack tendon, from the lengths that acted."""
        acted, length = self._engine.acted, self._displacements.folded_lengths()
        if rows is not None:
            acted, length, first, last = acted[rows], length[rows], first[rows], last[rows]
            drives = drives[0].rows(rows), drives[1].rows(rows)
        # What acts in a time step is its length at the start; the next one's is that at its end.
        gap = -first[:, None] - self._ramp * (last - first)[:, None]
        gap[:, :-1] += acted[:, :, 1:].transpose(0, 2, 1)
        gap[:, -1] += length
        return self._springs.slack(*drives, gap, rows)

    def _lengths(self, drive: JointVector) -> Any:
        """Return commanded lengths; the end of a step is the start of the next."""
        if self._held is None or self._held[0] is not drive:
            self._held = drive, self._springs.folded_lengths(drive)
        return self._held[1]

    def _run_whole(self, rows: NDArray[np.intp], drives: Motion) -> None:
        """Run the control step of the robots `rows` with all their tendons."""
        if rows.size:
            whole, engine = self._whole.engine, self._engine
            joints, *others = engine.kept(rows)
            if self._springs.friction is not None:
                whole.model_field("tendon_frictionloss")[rows] = self._drag(rows, joints, drives[0])
            whole.place(rows, joints, *others)
            self._whole.run(rows, *drives)
            self._repeated[rows] = True
            # The two have the same joints, so that one goes on where the other stopped.
            engine.place(rows, whole.qpos[rows], whole.qvel[rows], whole.warm[rows])

    def _drag(self, rows: NDArray[np.intp], joints: FloatArray, start: JointVector) -> FloatArray:
        """Return the tendons' friction [N] (R, N) where a control step begins."""
        robot, (x, y, passes) = self._springs.robot, self._pieces
        told = start.rows(rows).joint(robot)
        reached = map_rows(self._displacements.clarke(joints, rows), robot.decoder.T)
        wrapped = map_rows(np.hypot(joints[:, x], joints[:, y]), passes)
        return self._springs.drag(rows, told, reached, wrapped)

    @cached_property
    def _pieces(self) -> tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]:
        """Joints x and y of every bend that tendons wrap round, and which tendons do (P, N)."""
        robot, axes = self._springs.robot, [np.flatnonzero(c) for c in self._engine.chain.shape.T]
        segments = np.arange(robot.n_segments)
        here = np.repeat(segments, [len(x) for x in axes[::2]])
        passes = np.repeat(segments, robot.n_tendons) >= here[:, None]
        return np.concatenate(axes[::2]), np.concatenate(axes[1::2]), passes.astype(np.float64)
