"""Stable-Baselines3 as anyone uses it: SAC with hindsight replay, DummyVecEnv, no adapter of ours.

python examples/with_sb3_sac_her.py
"""

import torch
from stable_baselines3 import SAC, HerReplayBuffer
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

import clarke_gym  # noqa: F401

STEPS = 6_000
KEYWORDS = {
    "n_tendons": 7,
    "representation": "clarke",
    "goal_env": True,  # dictionary observations and compute_reward, for hindsight
    "reward": "sparse",
}


def main() -> None:
    """Train for a minute and print the share of goals that are reached."""
    torch.set_num_threads(1)  # networks this small run slower on more
    envs = make_vec_env("clarke_gym/Reach-v0", n_envs=8, seed=0, env_kwargs=KEYWORDS)
    model = SAC(
        "MultiInputPolicy",
        envs,
        replay_buffer_class=HerReplayBuffer,
        gamma=0.95,
        tau=0.02,
        learning_rate=2e-3,
        learning_starts=500,
        gradient_steps=4,
        policy_kwargs={"net_arch": [64, 64]},
        seed=0,
        device="cpu",
    )
    model.learn(STEPS)
    held_out = make_vec_env("clarke_gym/Reach-v0", n_envs=16, seed=1_000, env_kwargs=KEYWORDS)
    reached = []
    evaluate_policy(
        model,
        held_out,
        n_eval_episodes=48,
        callback=lambda local, _: (
            reached.append(local["info"]["is_success"]) if local["done"] else None
        ),
    )
    print(f"SAC with hindsight, {STEPS} steps: {sum(reached) / len(reached):.2f} of the goals")
    envs.close()
    held_out.close()


if __name__ == "__main__":
    main()
