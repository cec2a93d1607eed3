"""Configuration of a run, and how YAML files become configurations: every problem named at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeVar

import gymnasium as gym
import yaml
from pydantic import (
    BaseModel,
    Field,
    PositiveInt,
    ValidationError,
    field_validator,
    model_validator,
)

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import ROOT, ConfigError
from agents.learning.algorithms import ALGORITHMS, AlgoSettings, Model, PPOSettings, Settings
from agents.plugins import import_plugins

Scalar = bool | int | float | str
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]

_M = TypeVar("_M", bound=BaseModel)


class WithPlugins(Model):
    """A configuration whose plug-ins are imported before the rest of it is looked at."""

    plugins: list[str] = Field(default=[], exclude_if=lambda names: not names)
    """Modules that add tasks, robots or representations; found in the working directory, too."""

    @model_validator(mode="before")
    @classmethod
    def _import_plugins(cls, data: Any) -> Any:
        names = data.get("plugins") if isinstance(data, dict) else None
        if isinstance(names, list) and all(isinstance(name, str) for name in names):
            import_plugins(names)
        return data


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


class TrainConfig(WithPlugins):
    """One training run."""

    name: Name = "reach"
    env: EnvSettings = EnvSettings()
    algo: AlgoSettings = PPOSettings()
    total_steps: PositiveInt = 204_800
    seed: Annotated[int, Field(ge=0, lt=10_000)] = 0
    evaluation: EvalSettings = EvalSettings()
    checkpoint_every_steps: PositiveInt = 102_400
    """Environment steps between checkpoints."""

    @field_validator("algo")
    @classmethod
    def _installed(cls, algo: Settings) -> Settings:
        ALGORITHMS[algo.name].check_installed()
        return algo

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
        `TrainConfig`, or the configuration of something that is made of runs.
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
    if isinstance(data.get("base"), dict):  # the run that a study varies
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
