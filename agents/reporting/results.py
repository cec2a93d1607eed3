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

from agents.metrics import Metric

Array = NDArray[np.float64]
Status = Literal["done", "failed", "missing"]


class ResultsError(ValueError):
    """A study folder that cannot be read; the message names the file and the key."""


@dataclass(frozen=True)
class Evals:
    """Deterministic evaluations of one run on fixed held-out goals: E evaluations of G goals."""

    env_steps: NDArray[np.int64]  # (E,)
    is_success: NDArray[np.bool_]  # (E, G)
    episode_return: Array  # (E, G)
    metrics: tuple[Metric, ...]  # what the task measures, the leading metric first
    values: Mapping[str, Array]  # name of a metric -> (E, G), in SI units
    goals: Array | None = None  # (G, 3), where goals are places that stay [m]


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

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What its task measures, the leading metric first; empty where no run is finished."""
        return next((evals.metrics for _, evals in self.done), ())

    @property
    def seeds(self) -> list[int]:
        """Seeds of the runs that count, finished and failed, in their order."""
        return [run.seed for run in self.runs if run.status != "missing"]

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
    metrics: Mapping[str, float]
    """Mean over the goals, by the name of the metric, in SI units."""


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
    base: Mapping[str, Any]  # the run that arms change, as study.yaml has it
    registered: str = ""  # SHA-256 of what was preregistered
    planned_seeds: int | None = None  # of the preregistration
    registration_holds: bool = True  # whether study.yaml still has that hash
    per_goal: bool = True  # False where metrics are known as means over goals alone

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

    @cached_property
    def metrics(self) -> list[Metric]:
        """Every metric of every task, once each by name."""
        return list({m.name: m for arm in self.arms for m in arm.metrics}.values())

    @cached_property
    def leading(self) -> list[Metric]:
        """The metrics that lead in a task, once each by name; most studies have one."""
        return list({m.name: m for arm in self.arms for m in arm.metrics[:1]}.values())

    def leading_of(self, task: str) -> Metric | None:
        """Return the leading metric of a task; None where no run of it is finished."""
        return next((m for arm in self.of_task(task) for m in arm.metrics[:1]), None)

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

    def curves(self, arm: Arm, metric: Metric) -> Array:
        """Mean of a metric over goals in the unit that people read, shape (finished runs, E)."""
        means = [metric.factor * evals.values[metric.name].mean(axis=1) for _, evals in arm.done]
        return np.array(means, float).reshape(-1, len(self.env_steps))

    def final(self, arm: Arm, metric: Metric) -> Array:
        """Last values of a metric, shape (finished runs, G), in the unit that people read."""
        values = [metric.factor * evals.values[metric.name][-1] for _, evals in arm.done]
        return np.array(values, float).reshape(len(values), -1 if values else 1)
