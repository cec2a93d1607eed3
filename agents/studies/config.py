"""Pydantic models of every YAML file in configs/: unknown keys are errors, all errors at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeVar

import gymnasium as gym
import yaml
from pydantic import BaseModel, Field, PositiveInt, ValidationError, model_validator

import clarke_gym  # noqa: F401  (registers the environments)
from agents.learning.algorithms import AlgoSettings, Fraction, Model, PPOSettings

ROOT = Path(__file__).resolve().parents[2]

Scalar = bool | int | float | str
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]


_M = TypeVar("_M", bound=BaseModel)


class ConfigError(ValueError):
    """A configuration file that cannot be used; the message says where and why."""


class EnvSettings(Model):
    """Which environment, and its keyword arguments."""

    id: str = "clarke_gym/Reach-v0"
    """Registered id."""
    num_envs: PositiveInt = 32
    """Environments stepped together."""
    kwargs: dict[str, Scalar] = Field(default={})
    """Keyword arguments of `gym.make`: n_tendons, representation, physics, ..."""

    @model_validator(mode="after")
    def _constructible(self) -> EnvSettings:
        try:
            gym.make(self.id, **self.kwargs).close()  # type: ignore[arg-type]
        except (TypeError, ValueError, gym.error.Error) as error:
            raise ValueError(str(error)) from None
        return self


class EvalSettings(Model):
    """Evaluation on fixed held-out goals."""

    every_steps: PositiveInt = 10_240
    """Environment steps between evaluations; a multiple of the steps between updates."""
    n_goals: Annotated[int, Field(ge=50)] = 100
    """Held-out goals (the protocol asks for at least 50)."""


class TrainConfig(Model):
    """One training run."""

    name: Name = "reach"
    env: EnvSettings = EnvSettings()
    algo: AlgoSettings = PPOSettings()
    total_steps: PositiveInt = 204_800
    seed: Annotated[int, Field(ge=0, lt=10_000)] = 0
    evaluation: EvalSettings = EvalSettings()
    checkpoint_every_steps: PositiveInt = 102_400
    """Environment steps between checkpoints."""

    @model_validator(mode="after")
    def _on_the_grid(self) -> TrainConfig:
        update = self.algo.steps_per_update(self.env.num_envs)
        every = self.evaluation.every_steps
        problems = [
            f"{name}={value} must be a multiple of {what}={unit}"
            for name, value, what, unit in (
                ("evaluation.every_steps", every, "the steps between updates", update),
                ("total_steps", self.total_steps, "evaluation.every_steps", every),
                ("checkpoint_every_steps", self.checkpoint_every_steps, "steps a update", update),
            )
            if value % unit
        ]
        if problems:
            raise ValueError("; ".join(problems))
        return self


class Variant(Model):
    """One level of a study's factor: a label, and what it changes in the base run."""

    label: str
    env: dict[str, Scalar] = Field(default={})
    """Keyword arguments of the environment."""
    algo: dict[str, Any] = Field(default={})
    """Algorithm settings."""


class Thresholds(Model):
    """Levels that the report measures the steps to."""

    success: Fraction = 0.9


class StudyConfig(Model):
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
    representations: Annotated[list[Variant], Field(min_length=1)]
    tasks: Annotated[list[Variant], Field(min_length=1)]
    seeds: Annotated[list[int], Field(min_length=1)]
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


def load_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file, loaded safely.

    Raises
    ------
    ConfigError
        If the file is missing, is not YAML or does not hold a mapping.
    """
    try:
        data = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise ConfigError(f"{path}: {error}") from None
    if not isinstance(data, dict):
        raise ConfigError(f"{path}: expected a mapping of settings, got {type(data).__name__}")
    return data


def _resolve_algo(data: dict[str, Any]) -> dict[str, Any]:
    """Replace ``algo: ppo`` by the settings in configs/algos/ppo.yaml."""
    if isinstance(data.get("algo"), str):
        path = ROOT / "configs" / "algos" / f"{data['algo']}.yaml"
        return data | {"algo": load_yaml(path)}
    return data


def _override(data: dict[str, Any], overrides: dict[str, str]) -> None:
    for key, text in overrides.items():
        *parents, last = key.split(".")
        node = data
        for parent in parents:
            node = node.setdefault(parent, {})
            if not isinstance(node, dict):
                raise ConfigError(f"{key}: {parent!r} is not a group of settings")
        node[last] = yaml.safe_load(text)


def load_config(model: type[_M], path: Path, overrides: dict[str, str] | None = None) -> _M:
    """Return a validated configuration.

    Parameters
    ----------
    model : type
        `TrainConfig` or `StudyConfig`.
    path : Path
        YAML file.
    overrides : dict, optional
        Dotted key -> YAML text, e.g. ``{"env.kwargs.n_tendons": "7"}``.

    Raises
    ------
    ConfigError
        If the file or an override is wrong; all problems are listed at once.
    """
    data = load_yaml(path)
    if model is StudyConfig and isinstance(data.get("base"), dict):
        data["base"] = _resolve_algo(data["base"])
    data = _resolve_algo(data)
    _override(data, overrides or {})
    try:
        return model.model_validate(data)
    except ValidationError as error:
        lines = [
            f"  {'.'.join(str(part) for part in item['loc']) or 'file'}: {item['msg']}"
            + ("" if isinstance(item["input"], dict | BaseModel) else f" (got {item['input']!r})")
            for item in error.errors()
        ]
        raise ConfigError("\n".join([f"{path} is not valid:", *lines])) from None
