"""Configuration of a study: arms x tasks x seeds of one run."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from agents.files import ROOT
from agents.learning.algorithms import Fraction, Model
from agents.learning.config import Name, Scalar, Seed, TrainConfig, WithPlugins
from agents.registration import registration
from agents.yaml_files import read_yaml

COMMITTED: Path = ROOT / "configs" / "studies"
"""Where studies are committed; their seeds are taken."""

Few = 100
"""Levels of a factor at most: more do not fit a figure."""


class Variant(Model):
    """One level of a study's factor: a label, and what it changes in the base run."""

    label: Annotated[str, Field(min_length=1, max_length=60)]
    env: dict[str, Scalar] = Field(default={})
    """Keyword arguments of the environment."""
    algo: dict[str, Any] = Field(default={})
    """Algorithm settings."""
    only: list[str] = Field(default=[], exclude_if=lambda labels: not labels)
    """Of a representation: labels of the tasks that it runs on; all by default."""


MAX_RUNS = 10_000
"""Runs of a study at most; each is a folder that the report opens."""


class Thresholds(Model):
    """Levels that the report measures the steps to."""

    success: Fraction = 0.9


class Preregistration(Model):
    """What was decided before the first run. It is hashed into the report, with the arms."""

    question: str
    primary: Literal["auc"]
    """The primary metric: normalised AUC of held-out success."""
    family: str
    """The comparisons that a p-value is adjusted over."""
    rule: str
    """What will be concluded from what."""
    planned_seeds: Annotated[int, Field(gt=0)]
    fresh: bool = True
    """Whether the claim rests on seeds that no other committed study has used."""


class Range(Model):
    """Where a setting of the learner is sought."""

    low: float
    high: float
    log: bool = False

    @model_validator(mode="after")
    def _ordered(self) -> Range:
        if not self.low < self.high or (self.log and self.low <= 0.0):
            raise ValueError(
                f"low={self.low} must be below high={self.high}, and above 0 where log is true"
            )
        return self


class Search(Model):
    """What `train.py tune` tries, the same for every arm."""

    configurations: Annotated[int, Field(gt=0, le=1_000)]
    seeds: Annotated[list[Seed], Field(min_length=1, max_length=100)]
    """Seeds of the trials; the winners run on others."""
    space: Annotated[dict[str, Range], Field(min_length=1)]
    """Setting of the learner -> range."""
    seed: int = 0
    """Scrambles the quasi-random sequence."""


def factorial(factors: Any, data: dict[str, Any]) -> list[dict[str, Any]]:
    """Return every combination of levels as a representation, which a study may list in short.

    Parameters
    ----------
    factors : dict
        Factor -> level -> what it changes: a mapping with ``env`` and ``algo``.
    data : dict
        The study; its own `representations` come first.

    Returns
    -------
    list of dict

    Raises
    ------
    ValueError
        If factors are no such mappings, or two of them change the same setting.

    Examples
    --------
    >>> noise = {"unit": {}, "small": {"algo": {"log_std_init": -1.0}}}
    >>> sight = {"raw": {"env": {"observation_representation": "raw"}}, "clarke": {}}
    >>> [arm["label"] for arm in factorial({"noise": noise, "sight": sight}, {})]
    ['unit x raw', 'unit x clarke', 'small x raw', 'small x clarke']
    """
    if not isinstance(factors, dict) or not all(
        isinstance(f, dict) and f for f in factors.values()
    ):
        raise ValueError(f"factorial must hold factors, each with levels, got {factors!r}")
    arms = list(data.get("representations") or [])
    for levels in product(*(factor.items() for factor in factors.values())):
        arm: dict[str, Any] = {"label": " x ".join(str(label) for label, _ in levels)}
        for label, changes in levels:
            plain = isinstance(changes, dict) and {*changes} <= {"env", "algo"}
            if not plain or not all(isinstance(part, dict) for part in changes.values()):
                raise ValueError(f"level {label!r} must change env or algo, got {changes!r}")
            for part, settings in changes.items():
                into = arm.setdefault(part, {})
                if twice := sorted({*into} & {*settings}):
                    raise ValueError(f"{arm['label']!r} sets {', '.join(twice)} by two factors")
                into |= settings
        arms.append(arm)
    return arms


class StudyConfig(WithPlugins):
    """Representations x tasks x seeds, all else equal.

    An arm is one entry of `representations` on one of `tasks`: each changes keyword arguments of
    the environment (representations of actions and of observations, robot, disturbances) and
    settings of the learner.
    """

    name: Name
    title: str
    note: str = ""
    """Label that every figure carries."""
    baseline: str = "raw"
    """Representation that the others are compared with."""
    thresholds: Thresholds = Thresholds()
    tuning: str
    """How the hyper-parameters were chosen, and with which budget."""
    preregistration: Preregistration | None = Field(default=None, exclude_if=lambda p: p is None)
    search: Search | None = Field(default=None, exclude_if=lambda s: s is None)
    representations: Annotated[list[Variant], Field(min_length=1, max_length=Few)]
    tasks: Annotated[list[Variant], Field(min_length=1, max_length=Few)]
    seeds: Annotated[list[Seed], Field(min_length=1, max_length=10_000)]
    base: TrainConfig

    @model_validator(mode="before")
    @classmethod
    def _write_out_factors(cls, data: Any) -> Any:
        if not isinstance(data, dict) or "factorial" not in data:
            return data
        data = dict(data)
        return data | {"representations": factorial(data.pop("factorial"), data)}

    @model_validator(mode="after")
    def _consistent(self) -> StudyConfig:
        labels = [variant.label for variant in self.representations]
        if self.baseline not in labels:
            raise ValueError(f"baseline must be one of the representations {labels}")
        for name in ("representations", "tasks"):
            values = [variant.label for variant in getattr(self, name)]
            if len(set(values)) != len(values):
                raise ValueError(f"{name} must have different labels, got {values}")
        tasks = {task.label for task in self.tasks}
        for variant in self.representations:
            if unknown := sorted({*variant.only} - tasks):
                raise ValueError(f"{variant.label!r} runs only on {unknown}, which is no task")
        if len(set(self.seeds)) != len(self.seeds):
            raise ValueError(f"seeds must differ, got {self.seeds}")
        if self.search is not None and (shared := {*self.search.seeds} & {*self.seeds}):
            raise ValueError(f"search.seeds and seeds share {sorted(shared)}: winners need others")
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
        if self.preregistration is not None and self.preregistration.fresh:
            self._check_fresh()
        self.runs()  # every combination must be a valid run
        return self

    def _check_fresh(self) -> None:
        """Refuse seeds of other committed studies: two claims would rest on the same runs."""
        for path in sorted(COMMITTED.glob("*.yaml")):
            other = read_yaml(path)
            tried = (other.get("search") or {}).get("seeds", [])
            shared = sorted({*self.seeds} & {*other.get("seeds", []), *tried})
            if shared and other.get("name") != self.name:
                raise ValueError(
                    f"seeds {shared} are not fresh: {path.name} has used them; take others, or "
                    "say preregistration.fresh=false"
                )

    @property
    def registered(self) -> str | None:
        """SHA-256 of the preregistration with arms, tasks, base and thresholds; seeds may grow."""
        if self.preregistration is None:
            return None
        return registration(self.model_dump(mode="json"))

    def arms(self) -> list[tuple[str, Variant, Variant]]:
        """Return (folder name, representation, task) of every arm."""
        return [
            (_slug(f"{representation.label}_{task.label}"), representation, task)
            for task in self.tasks
            for representation in self.representations
            if not representation.only or task.label in representation.only
        ]

    def runs(self) -> list[TrainConfig]:
        """Return every run, seeds outermost so that an early stop leaves all arms comparable."""
        arms = [self._run(*arm) for arm in self.arms()]
        return [arm.model_copy(update={"seed": seed}) for seed in self.seeds for arm in arms]

    def _run(self, name: str, representation: Variant, task: Variant) -> TrainConfig:
        data = self.base.model_dump()
        data["name"] = name
        data["plugins"] = list(dict.fromkeys([*self.plugins, *self.base.plugins]))
        for variant in (task, representation):
            data["env"]["kwargs"].update(variant.env)
            if variant.algo.get("name", data["algo"]["name"]) != data["algo"]["name"]:
                data["algo"] = {}  # settings of one algorithm mean nothing to another
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
        data |= {"arms": arms, "total_steps": self.base.total_steps}
        return data | ({"registered": self.registered} if self.registered else {})


def growth(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return which keys of a resolved study changed otherwise than by more arms or seeds.

    Parameters
    ----------
    old, new : dict
        As `StudyConfig.resolved` returns them.

    Examples
    --------
    >>> growth({"seeds": [1], "name": "a"}, {"seeds": [1, 2], "name": "b"})
    ['name']
    """
    free = {"title", "note", "arms"}
    grows = {"representations", "tasks", "seeds"}  # arms that were registered are hashed with it
    changed = []
    for key in sorted({*old, *new} - free):
        before, after = old.get(key), new.get(key)
        if key in grows and isinstance(before, list) and isinstance(after, list):
            if all(entry in after for entry in before):
                continue
        elif before == after:
            continue
        changed.append(key)
    return changed


def _slug(text: str) -> str:
    return "".join(c if c.isalnum() or c in "._-" else "" for c in text)
