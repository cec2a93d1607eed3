"""Settings of the learning algorithms; the names are Stable-Baselines3's."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, PositiveInt

PositiveFloat = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]


class Model(BaseModel):
    """Frozen settings; an unknown key is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class PPOSettings(Model):
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


class _OffPolicySettings(Model):
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
