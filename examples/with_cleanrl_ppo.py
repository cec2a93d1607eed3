"""PPO in one file, in the manner of CleanRL: read it from the first line to the last.

python examples/with_cleanrl_ppo.py

What CleanRL's continuous PPO adds around its environments, `NormalizeObservation` first of all, is
left out: observations are scaled by the robot's limits already.
"""

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

import clarke_gym  # noqa: F401

N_TENDONS, NUM_ENVS, NUM_STEPS, UPDATES = 7, 32, 32, 56
GAMMA, LAMBDA, CLIP, EPOCHS, MINIBATCH, RATE = 0.95, 0.95, 0.2, 10, 256, 1e-3


def layer(inputs: int, outputs: int, gain: float = 2.0**0.5) -> nn.Linear:
    """Return a linear layer with orthogonal weights."""
    made = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(made.weight, gain)
    nn.init.zeros_(made.bias)
    return made


def network(inputs: int, outputs: int, gain: float) -> nn.Sequential:
    """Return two hidden layers of tanh."""
    hidden = layer(inputs, 64), nn.Tanh(), layer(64, 64), nn.Tanh()
    return nn.Sequential(*hidden, layer(64, outputs, gain))


def main() -> None:
    """Train and print the share of held-out goals that are reached."""
    torch.manual_seed(0)
    torch.set_num_threads(1)  # networks this small run slower on more
    make = {"n_tendons": N_TENDONS, "representation": "clarke"}
    # An episode's last observation comes in infos["final_obs"], the next one's first in its place.
    envs = gym.make_vec("clarke_gym/Reach-v0", NUM_ENVS, autoreset_mode="same_step", **make)
    width, actions = (
        space.shape[0] for space in (envs.single_observation_space, envs.single_action_space)
    )
    actor, critic = network(width, actions, 0.01), network(width, 1, 1.0)
    log_std = nn.Parameter(torch.zeros(actions))
    parameters = [*actor.parameters(), *critic.parameters(), log_std]
    optimiser = torch.optim.Adam(parameters, lr=RATE, eps=1e-5)

    def value(observation: np.ndarray) -> torch.Tensor:
        return critic(torch.as_tensor(observation)).squeeze(-1)

    shape = (NUM_STEPS, NUM_ENVS)
    obs, acts = torch.zeros(*shape, width), torch.zeros(*shape, actions)
    logp, rewards, values, nexts, ends = (torch.zeros(shape) for _ in range(5))
    observation, _ = envs.reset(seed=0)
    for _ in range(UPDATES):
        with torch.no_grad():
            for t in range(NUM_STEPS):
                obs[t] = torch.as_tensor(observation)
                policy = Normal(actor(obs[t]), log_std.exp())
                acts[t] = policy.sample()
                logp[t], values[t] = policy.log_prob(acts[t]).sum(-1), value(observation)
                observation, reward, ended, cut, infos = envs.step(acts[t].clamp(-1.0, 1.0).numpy())
                rewards[t], done = torch.as_tensor(reward), ended | cut
                following = observation.copy()
                if done.any():
                    following[done] = np.stack(list(infos["final_obs"][done]))
                nexts[t], ends[t] = value(following), torch.as_tensor(done)
                nexts[t][torch.as_tensor(ended)] = 0.0
            advantages, last = torch.zeros(shape), torch.zeros(NUM_ENVS)
            for t in reversed(range(NUM_STEPS)):
                delta = rewards[t] + GAMMA * nexts[t] - values[t]
                advantages[t] = last = delta + GAMMA * LAMBDA * (1.0 - ends[t]) * last
            returns = (advantages + values).flatten()
        flat = [part.flatten(0, 1) for part in (obs, acts, logp, advantages)]
        for _ in range(EPOCHS):
            for index in torch.randperm(NUM_STEPS * NUM_ENVS).split(MINIBATCH):
                o, a, old, advantage = (part[index] for part in flat)
                policy = Normal(actor(o), log_std.exp())
                ratio = (policy.log_prob(a).sum(-1) - old).exp()
                advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
                gain = torch.min(ratio * advantage, ratio.clamp(1.0 - CLIP, 1.0 + CLIP) * advantage)
                gap = critic(o).squeeze(-1) - returns[index]
                loss = -gain.mean() + 0.5 * gap.square().mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, 0.5)
                optimiser.step()
    envs.close()
    held_out = gym.make_vec("clarke_gym/Reach-v0", 100, **make)
    observation, _ = held_out.reset(seed=1_000)
    for _ in range(49):
        with torch.no_grad():
            action = actor(torch.as_tensor(observation)).clamp(-1.0, 1.0).numpy()
        observation, _, _, _, infos = held_out.step(action)
    steps = UPDATES * NUM_STEPS * NUM_ENVS
    print(f"PPO in one file, {steps} steps: {infos['is_success'].mean():.2f} of the goals")


if __name__ == "__main__":
    main()
