"""Control steps with folded tendons, repeated with all tendons where one of them goes slack."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from clarke_gym._arrays import FloatArray
from clarke_gym._linear_map import LinearMap
from clarke_gym.physics.base import JointVector
from clarke_gym.physics.engine import Engine
from clarke_gym.physics.tendons import TendonSprings


class FoldedSteps:
    """Runs robots whose taut tendons are folded into two a segment.

    Every tendon is checked at each time step. A robot with a slack one goes back to where it was
    and repeats the control step with all its tendons.

    Parameters
    ----------
    engine : Engine
        The robots with folded tendons.
    make_whole : callable
        Makes the engine of the same robots with all their tendons, once it is needed.
    springs : TendonSprings
    to_clarke : ndarray, shape (nq, 2S)
        Maps joint coordinates to Clarke coordinates.
    steps : int
        Time steps K of a control step.
    scalar : bool
        Whether drives come as floats, for a batch of one.
    """

    def __init__(
        self,
        engine: Engine,
        make_whole: Callable[[], Engine],
        springs: TendonSprings,
        to_clarke: FloatArray,
        steps: int,
        scalar: bool,
    ) -> None:
        self._engine, self._springs, self._steps = engine, springs, steps
        self._make_whole, self._scalar = make_whole, scalar
        self._watch_slack = bool(springs.pulls_only.any())
        self._to_folded = LinearMap(to_clarke @ springs.fold)
        self._ramp = (np.arange(1, steps + 1) / steps)[:, None]
        self._held: tuple[JointVector, FloatArray] | None = None

    @cached_property
    def _whole(self) -> Engine:
        return self._make_whole()

    def run(
        self,
        active: NDArray[np.bool_] | None,
        start: JointVector,
        end: JointVector,
        before: tuple[FloatArray, FloatArray],
    ) -> NDArray[np.bool_]:
        """Advance the robots `active` (None for all) by one control step.

        Parameters
        ----------
        active : ndarray of bool, shape (B,), or None
        start, end : JointVector
            The drives before and after.
        before : tuple of ndarray
            Joint coordinates and velocities at the start.

        Returns
        -------
        ndarray of bool, shape (B,)
            Robots that the engine gave up.
        """
        springs, engine = self._springs, self._engine
        rows = None if active is None else np.flatnonzero(active)
        first, last = self._lengths(start), self._lengths(end)
        if not self._watch_slack:
            return engine.run(rows, first, last, self._steps, False)[0]
        failed = np.zeros(len(engine.qpos), dtype=bool)
        if start.off_manifold is not None:
            # A robot that starts slack need not be tried with folded tendons first.
            loose = springs.slack(start, start, (self._actual_lengths() - first)[:, None])
            loose = loose if active is None else loose & active
            if loose.any():
                self._run_whole(np.flatnonzero(loose), start, end, before, failed)
                rows = np.flatnonzero(~loose if active is None else active & ~loose)
                if not rows.size:
                    return failed
        given_up, record = engine.run(rows, first, last, self._steps, True)
        assert record is not None  # as asked for
        failed |= given_up
        length, drives = self._actual_lengths(), (start, end)
        if rows is not None:
            first, last, length = first[rows], last[rows], length[rows]
            drives = start.rows(rows), end.rows(rows)
        # What acts in a time step is its length at the start; the next one's is that at its end.
        gap = -first[:, None] - self._ramp * (last - first)[:, None]
        gap[:, :-1] += record[:, 1:]
        gap[:, -1] += length
        slack = springs.slack(*drives, gap)
        if np.count_nonzero(slack):
            again = np.flatnonzero(slack) if rows is None else rows[slack]
            self._run_whole(again, start, end, before, failed)
        return failed

    def _lengths(self, drive: JointVector) -> FloatArray:
        """Return commanded lengths; the end of a step is the start of the next."""
        if self._held is None or self._held[0] is not drive:
            self._held = drive, self._springs.folded_lengths(drive)
        return self._held[1]

    def _actual_lengths(self) -> FloatArray:
        """Return how far the shapes shorten the virtual tendons, negative [m], shape (B, 2S)."""
        if self._scalar:
            return self._to_folded.of_numbers(self._engine.qpos[0])[None]
        return self._to_folded.of_rows(self._engine.qpos)

    def _run_whole(
        self,
        rows: NDArray[np.intp],
        start: JointVector,
        end: JointVector,
        before: tuple[FloatArray, FloatArray],
        failed: NDArray[np.bool_],
    ) -> None:
        """Run the control step of the robots `rows` with all their tendons."""
        whole, engine = self._whole, self._engine
        whole.qpos[rows], whole.qvel[rows] = before[0][rows], before[1][rows]
        targets = self._springs.lengths(start), self._springs.lengths(end)
        given_up, _ = whole.run(rows, *targets, self._steps, False)
        engine.qpos[rows], engine.qvel[rows] = whole.qpos[rows], whole.qvel[rows]
        failed[rows] = given_up[rows]
