"""Minari: demonstrations of classical control, recorded once in joint space, cloned in two views.

python examples/with_minari.py

The data set holds displacements of tendons, as a robot would log them. The Clarke view is a linear
map of the same numbers, so nothing has to be recorded again.
"""

import os
import tempfile
import warnings

import gymnasium as gym
import minari
import numpy as np
import torch
from minari.data_collector import EpisodeBuffer
from torch import nn

import clarke_gym  # noqa: F401
from clarke_gym.control import make_controller
from clarke_gym.representations import make_representation

N_TENDONS, EPISODES, UPDATES, SEEDS = 7, 12, 2_000, 3


def record() -> minari.MinariDataset:
    """Return a data set of a controller that hesitates now and then, in raw tendon space."""
    env = gym.make("clarke_gym/Reach-v0", n_tendons=N_TENDONS)
    controller = make_controller("clarke_controller", env)
    noise = np.random.default_rng(0)
    episodes = []
    for seed in range(EPISODES):
        controller.reset()
        observation, _ = env.reset(seed=seed)
        observations, steps = [observation], []
        while not steps or not (steps[-1][2] or steps[-1][3]):
            action = controller.act(observation)
            if noise.random() < 0.2:  # so that there is something to see off the straight way
                action = np.clip(action + noise.normal(0.0, 0.3, action.shape), -1.0, 1.0)
            action = action.astype(np.float32)
            observation, reward, terminated, truncated, _ = env.step(action)
            observations.append(observation)
            steps.append((action, reward, terminated, truncated))
        actions, rewards, terminations, truncations = map(np.array, zip(*steps, strict=True))
        episodes.append(
            EpisodeBuffer(
                id=seed,
                seed=seed,
                observations=np.array(observations),
                actions=actions,
                rewards=rewards,
                terminations=terminations,
                truncations=truncations,
            )
        )
    return minari.create_dataset_from_buffers(
        dataset_id="clarke_gym/reach-n7/classical-v0",
        buffer=episodes,
        env=env,
        algorithm_name="clarke_controller",
        description="Displacements of seven tendons under classical control with some noise.",
    )


def pairs(dataset: minari.MinariDataset, view: str) -> tuple[torch.Tensor, torch.Tensor]:
    """Return observations and actions in a representation."""
    robot = gym.make("clarke_gym/Reach-v0", n_tendons=N_TENDONS).unwrapped.robot
    encode = make_representation(view, robot).encode
    seen, done = [], []
    for episode in dataset.iterate_episodes():
        observation = episode.observations[:-1]
        command, displacement, rest = np.split(observation, [N_TENDONS, 2 * N_TENDONS], axis=1)
        seen.append(np.hstack([encode(command), encode(displacement), rest]))
        done.append(encode(episode.actions))
    return tuple(torch.as_tensor(np.concatenate(p), dtype=torch.float32) for p in (seen, done))


def clone(view: str, seen: torch.Tensor, done: torch.Tensor, seed: int) -> float:
    """Return the share of held-out goals that a cloned policy reaches."""
    torch.manual_seed(seed)
    policy = nn.Sequential(
        *(nn.Linear(seen.shape[1], 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh()),
        nn.Linear(64, done.shape[1]),
    )
    optimiser = torch.optim.Adam(policy.parameters(), lr=2e-3)
    for _ in range(UPDATES):
        index = torch.randint(len(seen), (256,))
        loss = nn.functional.mse_loss(policy(seen[index]), done[index])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
    envs = gym.make_vec("clarke_gym/Reach-v0", 100, n_tendons=N_TENDONS, representation=view)
    observation, _ = envs.reset(seed=1_000)
    for _ in range(49):
        with torch.no_grad():
            action = policy(torch.as_tensor(observation)).clamp(-1.0, 1.0).numpy()
        observation, _, _, _, infos = envs.step(action)
    return float(infos["is_success"].mean())


def main() -> None:
    """Record, clone in both views, and print what was reached."""
    torch.set_num_threads(1)  # networks this small run slower on more
    os.environ.setdefault("MINARI_DATASETS_PATH", tempfile.mkdtemp())
    # It would like an author, a permanent link and more, which a minute's data set does not have.
    warnings.filterwarnings("ignore", category=UserWarning, module="minari")
    dataset = record()
    for view in ("raw", "clarke"):
        seen, done = pairs(dataset, view)
        reached = [clone(view, seen, done, seed) for seed in range(SEEDS)]
        print(
            f"cloned from {EPISODES} episodes, {view}: {seen.shape[1]} numbers in, "
            f"{done.shape[1]} out, {np.mean(reached):.2f} of the goals "
            f"[{min(reached):.2f}, {max(reached):.2f}]"
        )


if __name__ == "__main__":
    main()
