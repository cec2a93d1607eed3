"""The adapter of Stable-Baselines3 equals its own vector environment, and is loaded on demand."""

import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
import torch
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.vec_env import DummyVecEnv

from clarke_gym.integrations.sb3 import Sb3VecEnv, make_sb3_vec_env

ID = "clarke_gym/Reach-v0"


def scalars(limits, **kwargs):
    return DummyVecEnv([lambda m=m: gym.make(ID, max_episode_steps=m, **kwargs) for m in limits])


def test_ppo_weights_are_bit_equal_through_the_adapter_and_dummy_vec_env():
    kwargs = {"n_tendons": 7, "representation": "clarke"}
    weights = []
    for env in (
        make_sb3_vec_env(ID, num_envs=8, max_episode_steps=13, **kwargs),
        scalars([13] * 8, **kwargs),
    ):
        torch.set_num_threads(1)
        model = PPO("MlpPolicy", env, n_steps=64, batch_size=128, seed=3, device="cpu")
        model.learn(2048)
        weights.append([parameter.detach().numpy() for parameter in model.policy.parameters()])
    for a, b in zip(*weights, strict=True):
        np.testing.assert_array_equal(a, b)


def test_hindsight_replay_works_and_equals_dummy_vec_env():
    kwargs = {"n_tendons": 4, "representation": "clarke", "goal_env": True, "reward": "sparse"}
    weights = []
    for env in (
        make_sb3_vec_env(ID, num_envs=2, max_episode_steps=10, **kwargs),
        scalars([10] * 2, **kwargs),
    ):
        model = SAC(
            "MultiInputPolicy",
            env,
            replay_buffer_class=HerReplayBuffer,
            learning_starts=40,
            batch_size=16,
            seed=1,
            device="cpu",
            policy_kwargs={"net_arch": [16]},
        )
        model.learn(80)
        weights.append([parameter.detach().numpy() for parameter in model.actor.parameters()])
    for a, b in zip(*weights, strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_end_of_an_episode_is_told_as_sb3_wants_it():
    vec_env = make_sb3_vec_env(ID, 3, max_episode_steps=2, n_tendons=5)
    vec_env.seed(7)
    vec_env.reset()
    actions = np.zeros((3, 5), np.float32)
    _, _, done, infos = vec_env.step(actions)
    assert not done.any()
    assert infos == [{}, {}, {}]
    observation, _, done, infos = vec_env.step(actions)
    assert done.all()
    for row, info in zip(observation, infos, strict=True):
        assert info["TimeLimit.truncated"]
        assert info["terminal_observation"].shape == row.shape
        assert not np.array_equal(info["terminal_observation"], row)  # a new episode has begun


def test_options_pictures_and_first_infos_are_those_of_dummy_vec_env():
    keywords = {"n_tendons": 5, "max_episode_steps": 2, "render_mode": "rgb_array"}
    keywords |= {"render_width": 64, "render_height": 64}
    ours = make_sb3_vec_env(ID, 2, **keywords)
    dummy = DummyVecEnv([lambda: gym.make(ID, **keywords)] * 2)
    options = [{"goal": [0.1, 0.0, 0.15]}, {"goal": [0.0, 0.1, 0.15]}]
    for each in (ours, dummy):
        each.seed(3)
        each.set_options(options)
    np.testing.assert_array_equal(ours.reset(), dummy.reset())
    goals = np.array([each["goal"] for each in options])
    np.testing.assert_allclose(ours.get_attr("goal")[0], goals, rtol=0, atol=1e-7)
    for one, other in zip(ours.get_images(), dummy.get_images(), strict=True):
        np.testing.assert_array_equal(one, other)
    assert ours.render().shape == dummy.render().shape
    for _ in range(2):
        ours.step(np.zeros((2, 5), np.float32))
        dummy.step(np.zeros((2, 5), np.float32))
    assert ours.reset_infos == dummy.reset_infos
    np.testing.assert_array_equal(ours.reset(), dummy.reset())  # options are for once
    ours.set_options([{"goal": [0.1, 0.0, 0.15]}, {}])
    with pytest.raises(ValueError, match="options must have the same names for all"):
        ours.reset()


def test_environments_that_reset_themselves_are_refused():
    with pytest.raises(ValueError, match='autoreset_mode="disabled"'):
        Sb3VecEnv(gym.make_vec(ID, num_envs=2))
    with pytest.raises(TypeError, match="autoreset_mode"):
        make_sb3_vec_env(ID, 2, autoreset_mode="same_step")


def run(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)


def test_importing_the_package_and_its_integrations_loads_neither_torch_nor_sb3():
    code = "import sys, clarke_gym, clarke_gym.control, clarke_gym.integrations\n"
    result = run(code + "print({'torch', 'stable_baselines3'} & set(sys.modules))")
    assert result.stdout.strip() == "set()", result.stderr


def test_what_to_install_is_named():
    code = "import sys; sys.modules['stable_baselines3'] = None; import clarke_gym.integrations.sb3"
    result = run(code)
    assert result.returncode == 1
    assert "needs Stable-Baselines3" in result.stderr.splitlines()[-1]
    assert 'pip install "clarke_gym[sb3]"' in result.stderr.splitlines()[-1]
