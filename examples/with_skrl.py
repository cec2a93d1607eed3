"""skrl: its wrapper, its PPO and its trainer on a clarke_gym vector environment.

python examples/with_skrl.py
"""

import logging

import gymnasium as gym
import torch
from skrl.agents.torch.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.models.torch import DeterministicMixin, GaussianMixin, Model
from skrl.trainers.torch import SequentialTrainer, SequentialTrainerCfg
from torch import nn

import clarke_gym  # noqa: F401

logging.getLogger("skrl").setLevel(logging.ERROR)

NUM_ENVS, STEPS = 32, 1_536
KEYWORDS = {"n_tendons": 7, "representation": "clarke"}


def network(inputs: int, outputs: int) -> nn.Sequential:
    """Return what SB3 calls its MlpPolicy."""
    hidden = nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()
    return nn.Sequential(*hidden, nn.Linear(64, outputs))


class Policy(GaussianMixin, Model):
    """Mean actions of a network, and a noise that does not depend on what is seen."""

    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        GaussianMixin.__init__(self)  # unclipped: the environment saturates actions
        self.network = network(self.num_observations, self.num_actions)
        self.log_std = nn.Parameter(torch.zeros(self.num_actions))

    def compute(self, inputs, role):
        return self.network(inputs["observations"]), {"log_std": self.log_std}


class Value(DeterministicMixin, Model):
    """The value of what is seen."""

    def __init__(self, **spaces):
        Model.__init__(self, **spaces)
        DeterministicMixin.__init__(self)
        self.network = network(self.num_observations, 1)

    def compute(self, inputs, role):
        return self.network(inputs["observations"]), {}


def main() -> None:
    """Train and print the share of held-out goals that are reached."""
    torch.manual_seed(0)
    torch.set_num_threads(1)  # networks this small run slower on more
    env = wrap_env(gym.make_vec("clarke_gym/Reach-v0", NUM_ENVS, **KEYWORDS), verbose=False)
    spaces = {"observation_space": env.observation_space, "action_space": env.action_space}
    spaces["device"] = "cpu"
    policy = Policy(**spaces)
    settings = PPO_CFG(
        rollouts=32,
        learning_epochs=10,
        mini_batches=4,
        discount_factor=0.95,
        learning_rate=1e-3,
        value_clip=0.0,
        value_loss_scale=0.5,
        time_limit_bootstrap=True,
    )
    settings.experiment.write_interval = settings.experiment.checkpoint_interval = 0
    agent = PPO(
        models={"policy": policy, "value": Value(**spaces)},
        memory=RandomMemory(memory_size=32, num_envs=NUM_ENVS, device="cpu"),
        cfg=settings,
        **spaces,
    )
    trainer = SequentialTrainerCfg(timesteps=STEPS, headless=True, disable_progressbar=True)
    SequentialTrainer(env=env, agents=agent, cfg=trainer).train()
    held_out = gym.make_vec("clarke_gym/Reach-v0", 100, **KEYWORDS, autoreset_mode="disabled")
    observation, info = held_out.reset(seed=1_000)
    for _ in range(50):
        with torch.no_grad():
            action = policy.network(torch.from_numpy(observation)).numpy()
        observation, _, _, _, info = held_out.step(action)
    held_out.close()
    reached = info["is_success"].mean()
    print(f"skrl's PPO, {STEPS * NUM_ENVS} steps: {reached:.2f} of the goals")


if __name__ == "__main__":
    main()
