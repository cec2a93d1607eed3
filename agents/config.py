"""Pydantic models of every YAML file in configs/: unknown keys are errors, all errors at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import gymnasium as gym
import yaml
from pydantic import BaseModel, ConfigDict, Field, PositiveInt, ValidationError, model_validator

import clarke_gym  # noqa: F401  (registers the environments)

ROOT = Path(__file__).resolve().parent.parent

Scalar = bool | int | float | str
PositiveFloat = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]


_M = TypeVar("_M", bound=BaseModel)


class ConfigError(ValueError):
    """A configuration file that cannot be used; the message says where and why."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class EnvSettings(_Model):
    """Which environment, and its keyword arguments."""

    id: str = "clarke_gym/Reach-v0"
    """Registered id."""
    num_envs: PositiveInt = 32
    """Environments stepped together."""
    kwargs: dict[str, Scalar] = {}
    """Keyword arguments of `gym.make`: n_tendons, representation, physics, ..."""

    @model_validator(mode="after")
    def _constructible(self) -> EnvSettings:
        try:
            gym.make(self.id, **self.kwargs).close()  # type: ignore[arg-type]
        except (TypeError, ValueError, gym.error.Error) as error:
            raise ValueError(str(error)) from None
        return self


class PPOSettings(_Model):
    """Proximal policy optimisation; the names are Stable-Baselines3's."""

    name: Literal["ppo"] = "ppo"
    learning_rate: PositiveFloat = 1e-3
    n_steps: PositiveInt = 32
    batch_size: PositiveInt = 256
    n_epochs: PositiveInt = 10
    gamma: Fraction = 0.95
    gae_lambda: Fraction = 0.95
    clip_range: PositiveFloat = 0.2
    ent_coef: Annotated[float, Field(ge=0.0)] = 0.0
    log_std_init: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """Logarithm of the initial exploration noise of each action coordinate."""
    net_arch: list[PositiveInt] = [64, 64]

    def steps_per_update(self, num_envs: int) -> int:
        """Return the environment steps between two updates of the policy."""
        return self.n_steps * num_envs

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the SB3 class."""
        del sizes  # PPO has no setting that depends on the robot
        fields = self.model_dump(exclude={"name", "net_arch", "log_std_init"})
        return fields | {
            "policy_kwargs": {"net_arch": self.net_arch, "log_std_init": self.log_std_init}
        }


class _OffPolicySettings(_Model):
    learning_rate: PositiveFloat = 1e-3
    buffer_size: PositiveInt = 200_000
    learning_starts: PositiveInt = 1_000
    batch_size: PositiveInt = 256
    gamma: Fraction = 0.95
    tau: Fraction = 0.01
    train_freq: PositiveInt = 1
    gradient_steps: PositiveInt = 1
    net_arch: list[PositiveInt] = [64, 64]

    def steps_per_update(self, num_envs: int) -> int:
        """Return the environment steps between two updates of the policy."""
        return self.train_freq * num_envs

    def _arguments(self, exclude: set[str]) -> dict[str, Any]:
        fields = self.model_dump(exclude=exclude | {"name", "net_arch"})
        return fields | {"policy_kwargs": {"net_arch": self.net_arch}}


class SACSettings(_OffPolicySettings):
    """Soft actor-critic; the names are Stable-Baselines3's."""

    name: Literal["sac"] = "sac"
    target_entropy_per_dof: Annotated[float, Field(allow_inf_nan=False)] | None = -1.0
    """Target entropy per physical degree of freedom (two a segment), the same for every
    representation; null for SB3's "auto", which is minus the number of action coordinates."""

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the SB3 class."""
        per_dof = self.target_entropy_per_dof
        entropy = "auto" if per_dof is None else per_dof * sizes["dof"]
        return self._arguments({"target_entropy_per_dof"}) | {"target_entropy": entropy}


class TD3Settings(_OffPolicySettings):
    """Twin delayed DDPG; the names are Stable-Baselines3's."""

    name: Literal["td3"] = "td3"
    exploration_noise: PositiveFloat = 0.1
    """Standard deviation of the noise in Clarke coordinates; representations with more
    coordinates get sqrt(k / 2) times as much each, so that tips explore alike."""

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the SB3 class, noise without its type."""
        scale = (sizes["action"] / sizes["dof"]) ** 0.5
        return self._arguments({"exploration_noise"}) | {
            "action_noise": self.exploration_noise * scale
        }


AlgoSettings = Annotated[PPOSettings | SACSettings | TD3Settings, Field(discriminator="name")]


class EvalSettings(_Model):
    """Evaluation on fixed held-out goals."""

    every_steps: PositiveInt = 10_240
    """Environment steps between evaluations; a multiple of the steps between updates."""
    n_goals: Annotated[int, Field(ge=50)] = 100
    """Held-out goals (the protocol asks for at least 50)."""


class TrainConfig(_Model):
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


class Variant(_Model):
    """One level of a study's factor: a label, and what it changes in the base run."""

    label: str
    env: dict[str, Scalar] = {}
    """Keyword arguments of the environment."""
    algo: dict[str, Any] = {}
    """Algorithm settings."""


class Thresholds(_Model):
    """Levels that the report measures the steps to."""

    success: Fraction = 0.9


class StudyConfig(_Model):
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
