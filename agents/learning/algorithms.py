"""Learning algorithms: the settings of each, and the class that learns with them, in one table.

Names of settings are those of Stable-Baselines3. To add one of its algorithms or of sb3-contrib's,
write its settings and one line of the table below; configs/algos/NAME.yaml lets studies say
``algo: NAME``.
"""

from __future__ import annotations

import importlib
import importlib.util
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Union, get_args

from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt, model_validator

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm

Count = Annotated[int, Field(gt=0, le=1_000_000)]
"""A number of things held in memory or done one after the other; more of them is a slip."""

Layers = Annotated[list[Annotated[int, Field(gt=0, le=4_096)]], Field(max_length=8)]
"""Sizes of hidden layers; larger ones than these do not fit a CPU's minutes."""

PositiveFloat = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]


def _takes_truth(annotation: Any) -> bool:
    """Return whether a field may be true or false."""
    return annotation in (bool, Any) or any(map(_takes_truth, get_args(annotation)))


def _holds_truth(value: Any) -> bool:
    """Return whether a value is true or false, or a list that holds such a one."""
    if isinstance(value, list | tuple):
        return any(map(_holds_truth, value))
    return isinstance(value, bool)


class Model(BaseModel):
    """Frozen settings; an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)

    @model_validator(mode="before")
    @classmethod
    def _truth_is_no_number(cls, data: Any) -> Any:
        for name, value in data.items() if isinstance(data, dict) else ():
            field = cls.model_fields.get(name)
            if field and _holds_truth(value) and not _takes_truth(field.annotation):
                raise ValueError(f"{name} must not be true or false, got {value!r}")
        return data


class Settings(Model):
    """What every algorithm's settings offer to a run."""

    name: str

    def steps_per_update(self, num_envs: int) -> int:
        """Return the environment steps between two updates of the policy."""
        raise NotImplementedError

    @property
    def manifold(self) -> dict[str, Any]:
        """Settings of a `ManifoldPolicy`; empty where Stable-Baselines3's own policy learns."""
        return {}

    @property
    def course(self) -> list[tuple[int, float]]:
        """Points of a `NoiseCourse`; empty where noise is learnt."""
        return []

    @property
    def ends_slowly(self) -> bool:
        """Whether the learning rate depends on how long the run is."""
        return False

    def problems(self, num_envs: int, goal_env: bool, episode: int) -> list[str]:
        """Return what of these settings does not go with the environments."""
        del num_envs, goal_env, episode
        return []

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the class.

        Parameters
        ----------
        sizes : dict
            "dof": physical degrees of freedom, "action": action coordinates, "num_envs":
            environments, "episode": steps after which an episode ends at the latest.
        """
        raise NotImplementedError


class PPOSettings(Settings):
    """Proximal policy optimisation."""

    _OF_MANIFOLD: ClassVar = ("mean_gain", "likelihood", "noise")

    name: Literal["ppo"] = "ppo"
    learning_rate: PositiveFloat = 1e-3
    final_learning_rate: PositiveFloat | None = Field(
        default=None, exclude_if=lambda rate: rate is None
    )
    """What the learning rate falls to, linearly to the end of the run; by default it stays. Such a
    run cannot be extended, as a longer one would have learnt faster from the start."""
    n_steps: Count = 32
    batch_size: Count = 256
    n_epochs: Count = 10
    gamma: Fraction = 0.95
    gae_lambda: Fraction = 0.95
    clip_range: PositiveFloat = 0.2
    ent_coef: Annotated[float, Field(ge=0.0, allow_inf_nan=False)] = 0.0
    log_std_init: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    """Logarithm of the initial exploration noise of each action coordinate."""
    net_arch: Layers = [64, 64]
    mean_gain: PositiveFloat | Literal["matched"] = Field(
        default=1.0, exclude_if=lambda gain: gain == 1.0
    )
    """What the network's output is multiplied by to give the mean of the actions; matched: so that
    a step of the optimiser moves it on the manifold as it does in Clarke coordinates."""
    likelihood: Literal["joint", "marginal"] = Field(
        default="joint", exclude_if=lambda name: name == "joint"
    )
    """Whether ratio, KL and entropy are those of the action, or of what reaches the manifold."""
    noise: Literal["coordinates", "manifold"] = Field(
        default="coordinates", exclude_if=lambda name: name == "coordinates"
    )
    """Whether noise is drawn for each number of the action, or on the manifold alone (then
    `log_std_init` is in Clarke coordinates, and `likelihood` must be marginal)."""
    noise_course: list[tuple[NonNegativeInt, PositiveFloat]] = Field(
        default=[], max_length=1_000, exclude_if=lambda course: not course
    )
    """Environment steps and the length of the noise on the manifold there, instead of noise that
    is learnt: for arms that are to explore as a recorded one did (its ``std_on``)."""

    @property
    def manifold(self) -> dict[str, Any]:
        """Settings of a `ManifoldPolicy`; empty where Stable-Baselines3's own policy learns."""
        # Those at their defaults are left out.
        return self.model_dump(include={*self._OF_MANIFOLD})

    @property
    def course(self) -> list[tuple[int, float]]:
        """Points of a `NoiseCourse`; empty where noise is learnt."""
        return self.noise_course

    @property
    def ends_slowly(self) -> bool:
        """Whether the learning rate depends on how long the run is."""
        return self.final_learning_rate is not None

    def problems(self, num_envs: int, goal_env: bool, episode: int) -> list[str]:
        """Return what of these settings does not go with each other or the environments."""
        del goal_env, episode
        if min(self.batch_size, self.n_steps * num_envs) < 2:
            return [
                f"batch_size={self.batch_size}, and n_steps={self.n_steps} times "
                f"num_envs={num_envs}, must be 2 or more: advantages are normalised"
            ]
        if self.noise == "manifold" and self.likelihood == "joint":
            return ["noise=manifold has no joint likelihood: it needs likelihood=marginal"]
        if self.noise == "manifold" and self.noise_course:
            return [
                "noise_course sets the noise of coordinates: it does not go with noise=manifold"
            ]
        steps = [step for step, _ in self.noise_course]
        if steps != sorted(set(steps)):
            return [f"noise_course must have rising steps, got {steps}"]
        return []

    def steps_per_update(self, num_envs: int) -> int:
        """Return the environment steps between two updates of the policy."""
        return self.n_steps * num_envs

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the class."""
        del sizes  # PPO has no setting that depends on the robot
        own = {"name", "net_arch", "log_std_init", "noise_course", *self._OF_MANIFOLD}
        fields = self.model_dump(exclude=own | {"final_learning_rate"})
        if self.final_learning_rate is not None:
            from stable_baselines3.common.utils import LinearSchedule

            fields["learning_rate"] = LinearSchedule(
                self.learning_rate, self.final_learning_rate, end_fraction=1.0
            )
        return fields | {
            "policy_kwargs": {"net_arch": self.net_arch, "log_std_init": self.log_std_init}
        }


class _OffPolicySettings(Settings):
    learning_rate: PositiveFloat = 1e-3
    buffer_size: Annotated[int, Field(gt=0, le=10_000_000)] = 200_000
    learning_starts: Count = 1_000
    batch_size: Count = 256
    gamma: Fraction = 0.95
    tau: Fraction = 0.01
    updates_per_env_step: Annotated[float, Field(gt=0.0, le=64.0, allow_inf_nan=False)] = 1.0
    """Gradient steps for each step of each environment; a whole number of them must fall on one
    step of all environments."""
    replay: Literal["uniform", "her"] = "uniform"
    """How past transitions are replayed: as they were, or by hindsight (her), four in five with a
    goal that was reached later in the episode. Hindsight needs ``env.kwargs.goal_env: true``, and
    learning begins when the first episodes have ended, if that is after `learning_starts`."""
    net_arch: Layers = [64, 64]

    def steps_per_update(self, num_envs: int) -> int:
        """Return the environment steps between two updates of the policy."""
        return num_envs

    def problems(self, num_envs: int, goal_env: bool, episode: int) -> list[str]:
        """Return what of these settings does not go with the environments."""
        found = []
        updates = self.updates_per_env_step * num_envs
        if abs(updates - round(updates)) > 1e-9 or round(updates) < 1:
            whole = max(1, round(updates)) / num_envs
            found.append(
                f"updates_per_env_step={self.updates_per_env_step} makes {updates} updates a step "
                f"of {num_envs} environments; the nearest that is whole is {whole}"
            )
        if self.replay == "her" and not goal_env:
            found.append("replay=her needs env.kwargs.goal_env=true")
        if self.replay == "her" and self.buffer_size < (least := 2 * episode * num_envs):
            found.append(
                f"replay=her needs a buffer_size of two episodes an environment, {least} or more, "
                f"got {self.buffer_size}"
            )
        return found

    def _arguments(self, sizes: dict[str, int], exclude: set[str]) -> dict[str, Any]:
        own = {"name", "net_arch", "updates_per_env_step", "replay"}
        fields = self.model_dump(exclude=exclude | own)
        fields |= {
            "train_freq": 1,
            "gradient_steps": round(self.updates_per_env_step * sizes["num_envs"]),
            "policy_kwargs": {"net_arch": self.net_arch},
        }
        if self.replay == "her":
            from stable_baselines3 import HerReplayBuffer

            first = sizes["episode"] * sizes["num_envs"]
            fields |= {
                "replay_buffer_class": HerReplayBuffer,
                "learning_starts": max(self.learning_starts, first),
            }
        return fields


class _MaximumEntropySettings(_OffPolicySettings):
    target_entropy_per_dof: Annotated[float, Field(allow_inf_nan=False)] | None = -1.0
    """Target entropy per physical degree of freedom (two a segment), the same for every
    representation; null for SB3's "auto", which is minus the number of action coordinates."""

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the class."""
        per_dof = self.target_entropy_per_dof
        entropy = "auto" if per_dof is None else per_dof * sizes["dof"]
        return self._arguments(sizes, {"target_entropy_per_dof"}) | {"target_entropy": entropy}


class SACSettings(_MaximumEntropySettings):
    """Soft actor-critic."""

    name: Literal["sac"] = "sac"


class TQCSettings(_MaximumEntropySettings):
    """Truncated quantile critics: soft actor-critic without the critics' most hopeful quantiles."""

    name: Literal["tqc"] = "tqc"
    top_quantiles_to_drop_per_net: Annotated[int, Field(ge=0, le=24)] = 2
    """Of 25; without the highest ones a critic hopes less."""


class TD3Settings(_OffPolicySettings):
    """Twin delayed DDPG."""

    name: Literal["td3"] = "td3"
    exploration_noise: PositiveFloat = 0.1
    """Standard deviation of the noise in Clarke coordinates; representations with more
    coordinates get sqrt(k / 2) times as much each, so that tips explore alike."""

    def arguments(self, sizes: dict[str, int]) -> dict[str, Any]:
        """Return the keyword arguments of the class, noise as its standard deviation."""
        scale = (sizes["action"] / sizes["dof"]) ** 0.5
        return self._arguments(sizes, {"exploration_noise"}) | {
            "action_noise": self.exploration_noise * scale
        }


@dataclass(frozen=True)
class Algorithm:
    """One algorithm: its settings, and where its class lives.

    Parameters
    ----------
    settings : type
    class_path : str
        ``module:class``; imported when a run needs it, since the module loads torch.
    group : str
        Dependency group of pyproject.toml that installs the module.
    """

    settings: type[Settings]
    class_path: str
    group: str = "train"

    @property
    def module(self) -> str:
        """Name of the module that holds the class."""
        return self.class_path.partition(":")[0]

    @property
    def installed(self) -> bool:
        """Whether the module is there to be imported."""
        return importlib.util.find_spec(self.module) is not None

    def check_installed(self) -> None:
        """Refuse an algorithm whose library is not installed.

        Raises
        ------
        ValueError
            Naming what to install.
        """
        if not self.installed:
            raise ValueError(
                f"it needs {self.module}, which is not installed: "
                f"python -m pip install --group {self.group}"
            )

    def load_class(self) -> type[BaseAlgorithm]:
        """Import and return the class.

        Raises
        ------
        ValueError
            If its library is not installed.
        """
        self.check_installed()
        found: type[BaseAlgorithm] = getattr(
            importlib.import_module(self.module), self.class_path.partition(":")[2]
        )
        return found


_TABLE = (
    Algorithm(PPOSettings, "stable_baselines3:PPO"),
    Algorithm(SACSettings, "stable_baselines3:SAC"),
    Algorithm(TD3Settings, "stable_baselines3:TD3"),
    Algorithm(TQCSettings, "sb3_contrib:TQC", group="contrib"),
)

ALGORITHMS = {algorithm.settings.model_fields["name"].default: algorithm for algorithm in _TABLE}
"""Name -> algorithm."""

if TYPE_CHECKING:
    AlgoSettings = Settings
else:  # the settings of one of them, told apart by their name
    AlgoSettings = Annotated[
        Union[tuple(algorithm.settings for algorithm in _TABLE)],  # noqa: UP007
        Field(discriminator="name"),
    ]
