"""Configuration of a run, and how YAML files become configurations: every problem named at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, TypeVar

import gymnasium as gym
from pydantic import (
    BaseModel,
    Field,
    PrivateAttr,
    ValidationError,
    field_validator,
    model_validator,
)

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import ROOT, ConfigError
from agents.learning.algorithms import ALGORITHMS, AlgoSettings, Model, PPOSettings, Settings
from agents.plugins import import_plugins
from agents.yaml_files import parse_yaml, read_yaml
from clarke_gym.representations.registry import POLAR

Scalar = bool | int | float | str
Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=100)]
Steps = Annotated[int, Field(gt=0, le=10_000_000_000)]
"""Environment steps; ten thousand million are years on one machine."""

Seed = Annotated[int, Field(ge=0, lt=10_000)]
"""Of a run; environments have seeds of their own, 100,000 apart."""

_M = TypeVar("_M", bound=BaseModel)


_NOT_OURS = frozenset(id for id in gym.registry if not id.startswith("clarke_gym/"))
"""Environments that came with Gymnasium or other packages: no run of this program is of them."""


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


_TRAININGS_OWN = ("num_envs", "vectorization_mode", "autoreset_mode")
"""Keyword arguments of `gym.make_vec` that are no environment's."""


class EnvSettings(Model):
    """Which environment, and its keyword arguments."""

    id: str = "clarke_gym/Reach-v0"
    """Registered id."""
    num_envs: Annotated[int, Field(gt=0, le=65_536)] = 32
    """Environments stepped together; a batch of more is slower, not faster."""
    kwargs: dict[str, Scalar] = Field(default={})
    """Keyword arguments of `gym.make`: n_tendons, representation, physics, ..."""
    _episode_steps: int = PrivateAttr(default=0)

    @property
    def episode_steps(self) -> int:
        """Steps after which an episode ends at the latest; 0 where the environment does not say."""
        return self._episode_steps

    @model_validator(mode="after")
    def _constructible(self) -> EnvSettings:
        if self.id not in gym.registry or self.id in _NOT_OURS:  # "module:Id" would import a module
            known = sorted(id for id in gym.registry if id not in _NOT_OURS)
            raise ValueError(
                f"id {self.id!r} is no environment of this package or of a plug-in: {known}"
            )
        if gym.registry[self.id].vector_entry_point is None:
            raise ValueError(
                f"{self.id} is registered without vector_entry_point, which training steps"
            )
        if taken := [name for name in _TRAININGS_OWN if name in self.kwargs]:
            raise ValueError(f"kwargs cannot hold {taken}: training sets what they say")
        try:
            keywords: dict[str, Any] = self.kwargs
            env = gym.make_vec(  # as training makes them
                self.id,
                1,
                vectorization_mode="vector_entry_point",
                autoreset_mode="disabled",
                **keywords,
            )
            self._episode_steps = int(getattr(env.unwrapped, "episode_steps", 0))
            env.close()
        except (TypeError, ValueError, OverflowError, MemoryError, gym.error.Error) as error:
            raise ValueError(str(error)) from None
        return self


class EvalSettings(Model):
    """Evaluation on fixed held-out goals."""

    every_steps: Steps = 10_240
    """Environment steps between evaluations; a multiple of the steps between updates."""
    n_goals: Annotated[int, Field(ge=50, le=10_000)] = 100
    """Held-out goals (the protocol asks for at least 50; each is an environment)."""


class TrainConfig(WithPlugins):
    """One training run."""

    name: Name = "reach"
    env: EnvSettings = EnvSettings()
    algo: AlgoSettings = PPOSettings()
    total_steps: Steps = 204_800
    seed: Seed = 0
    evaluation: EvalSettings = EvalSettings()
    checkpoint_every_steps: Steps = 102_400
    """Environment steps between checkpoints."""

    @field_validator("algo")
    @classmethod
    def _installed(cls, algo: Settings) -> Settings:
        ALGORITHMS[algo.name].check_installed()
        return algo

    @model_validator(mode="after")
    def _on_the_grid(self) -> TrainConfig:
        goal_env = self.env.kwargs.get("goal_env") is True
        problems = self.algo.problems(self.env.num_envs, goal_env, self.env.episode_steps)
        kwargs = self.env.kwargs
        actions = kwargs.get("action_representation") or kwargs.get("representation")
        linear = [*self.algo.manifold, *(["noise_course"] if self.algo.course else [])]
        if linear and actions in POLAR:
            problems.append(f"{', '.join(linear)} need linear actions, not {actions}")
        update = self.algo.steps_per_update(self.env.num_envs)
        every, checkpoints = self.evaluation.every_steps, self.checkpoint_every_steps
        if every % update or checkpoints % update:
            problems.append(
                f"evaluation.every_steps={every} and checkpoint_every_steps={checkpoints} must be "
                f"multiples of the steps between updates={update}"
                + _proposal(self.algo, self.env.num_envs, every, checkpoints)
            )
        if self.total_steps % every:
            below = self.total_steps // every * every
            near = [str(steps) for steps in (below, below + every) if steps]
            problems.append(
                f"total_steps={self.total_steps} must be a multiple of "
                f"evaluation.every_steps={every}; the nearest: {', '.join(near)}"
            )
        if problems:
            raise ValueError("; ".join(problems))
        return self


def _proposal(algo: Settings, num_envs: int, *multiples: int) -> str:
    """Say which numbers of environments nearby would divide."""

    def fits(n: int) -> bool:
        return all(steps % algo.steps_per_update(n) == 0 for steps in multiples)

    below = next((n for n in range(num_envs - 1, 0, -1) if fits(n)), None)
    above = next((n for n in range(num_envs + 1, 4 * num_envs) if fits(n)), None)
    near = [str(n) for n in (below, above) if n is not None]
    return f"; the nearest env.num_envs that do: {', '.join(near)}" if near else ""


def _resolve_algo(data: dict[str, Any]) -> None:
    """Replace ``algo: ppo`` by the settings in configs/algos/ppo.yaml."""
    name = data.get("algo")
    if isinstance(name, str):
        if name not in ALGORITHMS:
            raise ConfigError(f"unknown algorithm {name!r}; known are {', '.join(ALGORITHMS)}")
        data["algo"] = read_yaml(ROOT / "configs" / "algos" / f"{name}.yaml")


def _override(data: dict[str, Any], key: str, value: Any) -> None:
    *parents, last = key.split(".")
    node = data
    for parent in parents:
        node = node.setdefault(parent, {})
        if not isinstance(node, dict):
            raise ConfigError(f"{key}: {parent!r} is not a group of settings")
    node[last] = value


def _what(item: Any) -> str:
    """Return one problem of a configuration as part of a line."""
    where = ".".join(str(part) for part in item["loc"]) or "file"
    got = "" if isinstance(item["input"], dict | BaseModel) else f" (got {item['input']!r:.100})"
    return " ".join(f"{where}: {item['msg']}{got}".split())


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
    data = read_yaml(path)
    values = {key: parse_yaml(text, f"--set {key}") for key, text in (overrides or {}).items()}
    whole = ("algo", "base.algo")  # first, so that further overrides change what is chosen here
    for key in sorted(values, key=lambda key: key not in whole):
        if key not in whole:
            _resolve(data)
        _override(data, key, values[key])
    _resolve(data)
    return validated(model, data, str(path))


def validated(model: type[_M], data: dict[str, Any], where: str) -> _M:
    """Return a configuration that was put together; `where` says of what, for the message.

    Raises
    ------
    ConfigError
        With all problems at once.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        problems = "; ".join(_what(item) for item in error.errors())
        raise ConfigError(f"{where} is not valid: {problems}") from None


def _resolve(data: dict[str, Any]) -> None:
    _resolve_algo(data)
    if isinstance(data.get("base"), dict):  # the run that a study varies
        _resolve_algo(data["base"])
