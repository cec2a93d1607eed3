"""TorchRL: its wrapper, its losses, its advantage, on a clarke_gym vector environment.

python examples/with_torchrl.py
"""

import logging

import gymnasium as gym
import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torch.distributions import Independent, Normal
from torchrl.envs import GymWrapper
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import clarke_gym  # noqa: F401

logging.getLogger("torchrl").setLevel(logging.WARNING)

NUM_ENVS, UPDATES = 32, 30
KEYWORDS = {"n_tendons": 7, "representation": "clarke"}


def diagonal(loc: torch.Tensor, scale: torch.Tensor) -> Independent:
    """Return a normal distribution of actions; the environment saturates them."""
    return Independent(Normal(loc, scale), 1)


def main() -> None:
    """Train and print the share of held-out goals that are reached."""
    torch.manual_seed(0)
    torch.set_num_threads(1)  # networks this small run slower on more
    env = GymWrapper(gym.make("clarke_gym/Reach-v0", **KEYWORDS))
    width, actions = env.observation_spec["observation"].shape[-1], env.action_spec.shape[-1]
    env.close()

    def network(outputs: int, *last: nn.Module) -> nn.Sequential:
        hidden = nn.Linear(width, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()
        return nn.Sequential(*hidden, nn.Linear(64, outputs), *last)

    parameters = TensorDictModule(
        network(2 * actions, NormalParamExtractor()), ["observation"], ["loc", "scale"]
    )
    actor = ProbabilisticActor(
        parameters,
        in_keys=["loc", "scale"],
        distribution_class=diagonal,
        return_log_prob=True,
        default_interaction_type=ExplorationType.RANDOM,
    )
    critic = ValueOperator(network(1), in_keys=["observation"])
    advantage = GAE(gamma=0.95, lmbda=0.95, value_network=critic)
    loss = ClipPPOLoss(actor, critic, clip_epsilon=0.2, entropy_coeff=0.0, critic_coeff=0.5)
    optimiser = torch.optim.Adam(loss.parameters(), lr=1e-3)

    def episodes(seed: int, count: int = NUM_ENVS) -> GymWrapper:
        made = GymWrapper(
            gym.make_vec("clarke_gym/Reach-v0", count, **KEYWORDS, autoreset_mode="same_step")
        )
        made.set_seed(seed)
        return made

    train = episodes(0)
    for _ in range(UPDATES):
        with torch.no_grad():
            rollout = train.rollout(50, actor)
            advantage(rollout)
        flat = rollout.reshape(-1)
        for _ in range(10):
            for index in torch.randperm(len(flat)).split(400):
                parts = loss(flat[index])
                optimiser.zero_grad()
                sum(parts[k] for k in ("loss_objective", "loss_critic")).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimiser.step()
    train.close()
    held_out = episodes(1_000, 100)
    with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
        final = held_out.rollout(49, actor)["next", "observation"][:, -1]
    held_out.close()
    gap = final[:, -3:].norm(dim=-1)  # the last three entries: goal less tip, over the length
    reached = (gap <= 0.02).float().mean()
    print(f"TorchRL's PPO, {UPDATES * 50 * NUM_ENVS} steps: {reached:.2f} of the goals")


if __name__ == "__main__":
    main()
