"""Control steps with folded tendons, repeated with all tendons where one of them goes slack."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.linear_map import LinearMap
from clarke_gym.physics.base import JointVector
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.single_engine import SingleEngine
from clarke_gym.physics.mujoco.tendons import TendonSprings
from clarke_gym.physics.mujoco.whole import WholeSteps, ramp_rates

Motion: TypeAlias = tuple[JointVector, JointVector]
"""Where the drives are before and after a control step."""

_ROW = np.array([0])


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
    to_clarke : ndarray, shape (nq, 2S)
        Maps joint coordinates to Clarke coordinates.
    steps : int
        Time steps K of a control step.
    """

    def __init__(
        self,
        engine: Engine,
        make_whole: Callable[[], WholeSteps],
        springs: TendonSprings,
        to_clarke: FloatArray,
        steps: int,
    ) -> None:
        self._engine, self._springs, self._steps = engine, springs, steps
        self._single = engine if isinstance(engine, SingleEngine) else None
        self._duration = steps * engine.chain.model.opt.timestep
        self._make_whole = make_whole
        self._watch_slack = bool(springs.pulls_only.any())
        self._to_folded = LinearMap(to_clarke @ springs.fold)
        self._ramp = (np.arange(1, steps + 1) / steps)[:, None]
        self._held: tuple[JointVector, Any] | None = None

    @cached_property
    def _whole(self) -> WholeSteps:
        return self._make_whole()

    def run(self, rows: NDArray[np.intp] | None, start: JointVector, end: JointVector) -> None:
        """Advance the robots `rows` (None for all) by one control step.

        Parameters
        ----------
        rows : ndarray of int, or None
        start, end : JointVector
            The drives before and after.
        """
        first, last = self._lengths(start), self._springs.folded_lengths(end)
        self._held = end, last
        rates = ramp_rates(first, last, self._duration)
        if not self._watch_slack:
            self._engine.run(rows, first, rates, self._steps)
            return
        if self._single is None:
            self._run_batch(rows, (start, end), (first, last), rates)
            return
        # The scalar environment's robot, whose lengths come as floats.
        on_manifold = start.off_manifold is None
        if on_manifold or not self._starts_loose(start, first)[0]:
            self._single.run(None, first, rates, self._steps)
            if on_manifold and end.off_manifold is None:
                meanwhile = self._single.lengths_meanwhile()
                after = self._single.tendon_lengths()
                if self._springs.surely_taut(first, last, meanwhile, after):
                    return
            ends = np.array([first]), np.array([last])
            acted = self._single.acted
            if not self._went_slack((start, end), ends, acted, self._actual_lengths())[0]:
                return
        self._run_whole(_ROW, (start, end))

    def _run_batch(
        self,
        rows: NDArray[np.intp] | None,
        drives: Motion,
        ends: tuple[FloatArray, FloatArray],
        rates: FloatArray,
    ) -> None:
        start, end = drives
        if start.off_manifold is not None:
            # A robot that starts slack need not be tried with folded tendons first.
            loose = self._starts_loose(start, ends[0])
            if np.count_nonzero(loose):
                rows = np.arange(len(rates)) if rows is None else rows
                self._run_whole(rows[loose[rows]], drives)
                rows = rows[~loose[rows]]
                if not rows.size:
                    return
        self._engine.run(rows, ends[0], rates, self._steps)
        acted, length, watched = self._engine.acted, self._actual_lengths(), drives
        if rows is not None:
            ends, acted, length = (ends[0][rows], ends[1][rows]), acted[rows], length[rows]
            watched = start.rows(rows), end.rows(rows)
        slack = self._went_slack(watched, ends, acted, length)
        if np.count_nonzero(slack):
            self._run_whole(np.flatnonzero(slack) if rows is None else rows[slack], drives)

    def _starts_loose(self, start: JointVector, first: Any) -> NDArray[np.bool_]:
        gap = self._actual_lengths() - first
        return self._springs.slack(start, start, gap[:, None])

    def _went_slack(
        self,
        drives: Motion,
        ends: tuple[FloatArray, FloatArray],
        acted: FloatArray,
        length: FloatArray,
    ) -> NDArray[np.bool_]:
        """Return which robots had a slack tendon, from the lengths that acted and the last ones."""
        first, last = ends
        # What acts in a time step is its length at the start; the next one's is that at its end.
        gap = -first[:, None] - self._ramp * (last - first)[:, None]
        gap[:, :-1] += acted[:, :, 1:].transpose(0, 2, 1)
        gap[:, -1] += length
        return self._springs.slack(*drives, gap)

    def _lengths(self, drive: JointVector) -> Any:
        """Return commanded lengths; the end of a step is the start of the next."""
        if self._held is None or self._held[0] is not drive:
            self._held = drive, self._springs.folded_lengths(drive)
        return self._held[1]

    def _actual_lengths(self) -> FloatArray:
        """Return how far the shapes shorten the virtual tendons, negative [m], shape (B, 2S)."""
        if self._single is not None:
            return self._to_folded.of_numbers(self._single.qpos[0])[None]
        return self._to_folded.of_rows(self._engine.qpos)

    def _run_whole(self, rows: NDArray[np.intp], drives: Motion) -> None:
        """Run the control step of the robots `rows` with all their tendons."""
        if rows.size:
            whole, engine = self._whole.engine, self._engine
            whole.place(rows, *engine.kept(rows))
            self._whole.run(rows, *drives)
            # The two have the same joints, so that one goes on where the other stopped.
            engine.place(rows, whole.qpos[rows], whole.qvel[rows], whole.warm[rows])
