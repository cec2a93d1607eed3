"""Configuration of a study: representations x tasks x seeds of one run."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field, model_validator

from agents.learning.algorithms import Fraction, Model
from agents.learning.config import Name, Scalar, TrainConfig, WithPlugins

Few = 100
"""Levels of a factor at most: more do not fit a figure."""


class Variant(Model):
    """One level of a study's factor: a label, and what it changes in the base run."""

    label: Annotated[str, Field(min_length=1, max_length=60)]
    env: dict[str, Scalar] = Field(default={})
    """Keyword arguments of the environment."""
    algo: dict[str, Any] = Field(default={})
    """Algorithm settings."""


MAX_RUNS = 10_000
"""Runs of a study at most; each is a folder that the report opens."""


class Thresholds(Model):
    """Levels that the report measures the steps to."""

    success: Fraction = 0.9


class StudyConfig(WithPlugins):
    """Representations x tasks x seeds, all else equal."""

    name: Name
    title: str
    note: str = ""
    """Label that every figure carries."""
    baseline: str = "raw"
    """Representation that the others are compared with."""
    thresholds: Thresholds = Thresholds()
    tuning: str
    """How the hyper-parameters were chosen, and with which budget."""
    representations: Annotated[list[Variant], Field(min_length=1, max_length=Few)]
    tasks: Annotated[list[Variant], Field(min_length=1, max_length=Few)]
    seeds: Annotated[list[int], Field(min_length=1, max_length=10_000)]
    base: TrainConfig

    @model_validator(mode="after")
    def _consistent(self) -> StudyConfig:
        labels = [variant.label for variant in self.representations]
        if self.baseline not in labels:
            raise ValueError(f"baseline must be one of the representations {labels}")
        for name in ("representations", "tasks"):
            values = [variant.label for variant in getattr(self, name)]
            if len(set(values)) != len(values):
                raise ValueError(f"{name} must have different labels, got {values}")
        if len(set(self.seeds)) != len(self.seeds):
            raise ValueError(f"seeds must differ, got {self.seeds}")
        folders: dict[str, str] = {}
        for name, representation, task in self.arms():
            arm = f"{representation.label!r} on {task.label!r}"
            other = folders.setdefault(name.casefold(), arm)  # some disks know no upper case
            if other != arm:
                raise ValueError(
                    f"the arms {other} and {arm} would share the folder {name!r}: give labels that "
                    "differ in letters, digits, '.', '_' or '-'"
                )
        if len(folders) * len(self.seeds) > MAX_RUNS:
            raise ValueError(f"{len(folders) * len(self.seeds)} runs, more than {MAX_RUNS}")
        self.runs()  # every combination must be a valid run
        return self

    def arms(self) -> list[tuple[str, Variant, Variant]]:
        """Return (folder name, representation, task) of every arm."""
        return [
            (_slug(f"{representation.label}_{task.label}"), representation, task)
            for task in self.tasks
            for representation in self.representations
        ]

    def runs(self) -> list[TrainConfig]:
        """Return every run, seeds outermost so that an early stop leaves all arms comparable."""
        return [
            self._run(name, representation, task, seed)
            for seed in self.seeds
            for name, representation, task in self.arms()
        ]

    def _run(self, name: str, representation: Variant, task: Variant, seed: int) -> TrainConfig:
        data = self.base.model_dump()
        data["name"], data["seed"] = name, seed
        data["plugins"] = list(dict.fromkeys([*self.plugins, *self.base.plugins]))
        for variant in (task, representation):
            data["env"]["kwargs"].update(variant.env)
            data["algo"].update(variant.algo)
        return TrainConfig.model_validate(data)

    def resolved(self) -> dict[str, Any]:
        """Return what study.yaml holds: the configuration and the arms as the report reads them."""
        arms = [
            {
                "name": name,
                "representation": representation.label,
                "task": task.label,
                "seeds": self.seeds,
            }
            for name, representation, task in self.arms()
        ]
        data = self.model_dump(mode="json")
        return data | {"arms": arms, "total_steps": self.base.total_steps}


def _slug(text: str) -> str:
    return "".join(c if c.isalnum() or c in "._-" else "" for c in text)
