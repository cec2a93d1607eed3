"""A study's results as typed arrays; `agents.reporting.loading` reads them from run folders.

A run counts by its marker file: ``DONE`` is finished; ``FAILED`` counts as success 0 at every
evaluation; neither means missing, and the run stays out of every statistic but is listed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Status = Literal["done", "failed", "missing"]


class ResultsError(ValueError):
    """A study folder that cannot be read; the message names the file and the key."""


@dataclass(frozen=True)
class Evals:
    """Deterministic evaluations of one run on fixed held-out goals: E evaluations of G goals."""

    env_steps: NDArray[np.int64]  # (E,)
    is_success: NDArray[np.bool_]  # (E, G)
    tip_error_m: Array  # (E, G)
    tip_error_percent: Array  # (E, G), of the robot's length
    episode_return: Array  # (E, G)


@dataclass(frozen=True)
class Run:
    """One training seed of one arm. `wall_s` (E,) is the wall clock at each evaluation."""

    arm: str
    seed: int
    path: Path
    status: Status
    evals: Evals | None
    manifest: Mapping[str, Any]
    wall_s: Array | None


@dataclass(frozen=True)
class Arm:
    """One representation on one task, with a run for each planned seed."""

    name: str
    representation: str
    task: str
    runs: tuple[Run, ...]

    def count(self, status: Status) -> int:
        """Return the number of runs with that status."""
        return sum(run.status == status for run in self.runs)

    @property
    def done(self) -> list[tuple[Run, Evals]]:
        """Finished runs with their evaluations, in the order of the seeds."""
        return [(run, run.evals) for run in self.runs if run.evals is not None]


@dataclass(frozen=True)
class Reference:
    """What classical control reaches on a task's held-out goals."""

    agent: str
    success_rate: float
    tip_error_mm: float


@dataclass(frozen=True)
class Study:
    """A resolved study and its runs; `env_steps` (E,) is the grid all evaluations share."""

    name: str
    title: str
    note: str
    baseline: str
    threshold: float
    tuning: str
    total_steps: int
    arms: tuple[Arm, ...]
    env_steps: NDArray[np.int64]
    references: Mapping[str, Reference]

    @property
    def runs(self) -> list[Run]:
        """Every planned run."""
        return [run for arm in self.arms for run in arm.runs]

    @cached_property
    def tasks(self) -> list[str]:
        """Tasks in the order of the study file."""
        return list(dict.fromkeys(arm.task for arm in self.arms))

    @cached_property
    def representations(self) -> list[str]:
        """Representations, the baseline first, then in the order of the study file."""
        names = dict.fromkeys(arm.representation for arm in self.arms)
        return sorted(names, key=lambda name: name != self.baseline)

    def of_task(self, task: str) -> list[Arm]:
        """Arms of a task in the order of `representations`."""
        arms = [arm for arm in self.arms if arm.task == task]
        return sorted(arms, key=lambda arm: self.representations.index(arm.representation))

    def success(self, arm: Arm) -> Array:
        """Success rate over goals, shape (finished + failed runs, E); failed runs are zeros."""
        zeros = np.zeros(len(self.env_steps))
        rates = [
            zeros if run.evals is None else run.evals.is_success.mean(axis=1)
            for run in arm.runs
            if run.status != "missing"
        ]
        return np.array(rates, float).reshape(-1, len(self.env_steps))

    def tip_error_mm(self, arm: Arm) -> Array:
        """Mean tip error over goals in millimetres, shape (finished runs, E)."""
        errors = [1e3 * evals.tip_error_m.mean(axis=1) for _, evals in arm.done]
        return np.array(errors, float).reshape(-1, len(self.env_steps))

    def final_errors_mm(self, arm: Arm) -> Array:
        """Last tip errors in mm, shape (finished + failed runs, G); infinite for a failed run."""
        finished = [1e3 * evals.tip_error_m[-1] for _, evals in arm.done]
        goals = len(finished[0]) if finished else 1
        lost = [np.full(goals, np.inf)] * arm.count("failed")
        return np.array(finished + lost, float).reshape(-1, goals)
