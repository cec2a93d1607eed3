"""A released policy runs on NumPy alone, and says what its learning library says."""

import json
import shutil
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym  # noqa: F401
from clarke_gym.control import load_policy

FOLDER = Path(__file__).resolve().parents[2] / "policies"
POLICIES = sorted(FOLDER.glob("*/policy.json"))


@pytest.mark.parametrize("path", POLICIES, ids=lambda path: path.parent.name)
def test_it_acts_as_in_its_learning_library(path):
    torch = pytest.importorskip("torch")
    tensors = pytest.importorskip("safetensors.torch").load_file(path.parent / "policy.safetensors")
    policy = load_policy(path.parent)
    shape = policy.about["observation_space"]["shape"]
    seen = np.random.default_rng(3).uniform(-1.0, 1.0, (64, *shape)).astype(np.float32)
    values = torch.as_tensor(seen)
    for k in (0, 2):
        name = f"mlp_extractor.policy_net.{k}"
        values = torch.tanh(values @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"])
    values = values @ tensors["action_net.weight"].T + tensors["action_net.bias"]
    np.testing.assert_allclose(policy.act(seen), values.clamp(-1.0, 1.0), atol=1e-5)


@pytest.mark.parametrize("n", [3, 11, 32])
def test_the_policy_of_seven_tendons_reaches_goals_with_others(n):
    policy = load_policy(FOLDER / "reach")
    assert policy.about["env"]["kwargs"]["n_tendons"] == 7
    envs = gym.make_vec("clarke_gym/Reach-v0", num_envs=32, n_tendons=n, representation="clarke")
    observations, _ = envs.reset(seed=5)
    for _ in range(49):
        observations, *_, infos = envs.step(policy.act(observations))
    assert infos["is_success"].all()


def test_damaged_files_are_named(tmp_path):
    folder = tmp_path / "policy"
    shutil.copytree(FOLDER / "reach", folder)
    tensors = folder / "policy.safetensors"
    whole = tensors.read_bytes()
    for damaged in (whole[:-4000], b"", b"\x00" * 100):
        tensors.write_bytes(damaged)
        with pytest.raises(ValueError, match=r"policy\.safetensors (is no|holds no)"):
            load_policy(folder)
    tensors.write_bytes(whole)
    about = json.loads((folder / "policy.json").read_text()) | {
        "settings": {"mean_gain": "matched"}
    }
    (folder / "policy.json").write_text(json.dumps(about))
    with pytest.raises(ValueError, match="by what the output is multiplied"):
        load_policy(folder)
    about |= {"algorithm": "sac"}
    (folder / "policy.json").write_text(json.dumps(about))
    with pytest.raises(ValueError, match="holds no policy of PPO"):
        load_policy(folder)


def test_files_without_a_bias_or_a_description_are_named(tmp_path):
    folder = tmp_path / "policy"
    shutil.copytree(FOLDER / "reach", folder)
    whole = (folder / "policy.safetensors").read_bytes()
    (folder / "policy.safetensors").write_bytes(
        whole.replace(b"action_net.bias", b"action_net.else")
    )
    with pytest.raises(ValueError, match=r"lacks \['action_net.bias'\]"):
        load_policy(folder)
    (folder / "policy.json").write_text("[]")
    with pytest.raises(ValueError, match="no description of a policy"):
        load_policy(folder)


def test_observations_of_another_size_are_refused_with_what_the_policy_was_trained_on():
    policy = load_policy(FOLDER / "reach")
    observation = gym.make("clarke_gym/Reach-v0", n_tendons=7).reset(seed=0)[0]
    with pytest.raises(ValueError, match=r"takes observations of 13 .*'representation': 'clarke'"):
        policy.act(observation)
