"""Diagnostics say what happened, and change nothing."""

import numpy as np
import pytest

from agents.learning.config import TrainConfig, load_config
from agents.learning.diagnostics import Diagnostics
from agents.learning.training import train

RUN = """
env: {{num_envs: 8, kwargs: {{n_tendons: 5, representation: {representation}}}}}
algo: {algo}
total_steps: 1024
checkpoint_every_steps: 512
evaluation: {{every_steps: 256, n_goals: 50}}
"""
PPO = "{name: ppo, n_steps: 32, batch_size: 128, n_epochs: 2}"


def run(folder, representation="raw", algo=PPO, **overrides):
    path = folder.with_suffix(".yaml")
    path.write_text(RUN.format(representation=representation, algo=algo))
    train(load_config(TrainConfig, path, overrides), folder)
    with np.load(folder / "diagnostics.npz") as file:
        return {name: file[name] for name in file.files}


def test_one_row_an_update_with_the_noise_of_every_coordinate(tmp_path):
    found = run(tmp_path / "run")
    assert found["env_steps"].tolist() == [256, 512, 768, 1024]
    assert found["log_std"].shape == (4, 5)
    assert all(np.isfinite(values).all() for values in found.values())
    # Unit noise of five tendons: 2 of 5 parts lie on the manifold, times 2 / n.
    assert found["noise_on"][0] == pytest.approx(np.sqrt(2 * 2 / 5), rel=0.1)
    assert found["noise_off"][0] == pytest.approx(np.sqrt(3 * 2 / 5), rel=0.1)
    assert found["std_on"][0] == pytest.approx(np.sqrt(2 * 2 / 5), rel=0.05)
    assert found["outside_box"][0] == pytest.approx(0.317, abs=0.04)
    assert {"approx_kl", "clip_fraction", "explained_variance", "gradient"} <= found.keys()


def test_clarke_actions_have_nothing_off_the_manifold(tmp_path):
    found = run(tmp_path / "run", "clarke")
    for name in ("mean_off", "noise_off", "std_off", "gradient_head_off"):
        np.testing.assert_allclose(found[name], 0.0, atol=1e-7)
    # The length of two unit Gaussians, each clipped to the box, passes 1 in about 0.57 of cases.
    assert 0.45 < found["saturated"][0] < 0.7


def test_off_policy_algorithms_have_a_row_an_evaluation(tmp_path):
    algo = "{name: sac, learning_starts: 300, batch_size: 32, updates_per_env_step: 0.125}"
    found = run(tmp_path / "run", algo=algo)
    assert found["env_steps"].tolist() == [256, 512, 768, 1024]
    assert np.isnan(found["critic_loss"][0])
    assert np.isfinite(found["critic_loss"][1:]).all()


def test_commands_off_the_manifold_are_counted_against_their_limit(tmp_path):
    env = {"env.kwargs": "{n_tendons: 5, representation: raw, max_cocontraction_m: 1.0e-4}"}
    tight = run(tmp_path / "tight", **env)
    loose = run(tmp_path / "loose", **{"env.kwargs": env["env.kwargs"].replace("1.0e-4", "0.1")})
    assert (tight["command_off"] <= 1.0 + 1e-6).all()
    assert tight["command_off"].min() > 0.5  # unit noise soon fills a tenth of a millimetre
    assert tight["capped"].min() > 0.3
    assert loose["command_off"].max() < 0.5
    assert loose["capped"].max() == 0.0
    assert "slack" not in tight
    clarke = run(tmp_path / "clarke", "clarke")
    np.testing.assert_allclose(clarke["command_off"], 0.0, atol=1e-9)


def test_slack_tendons_are_counted_where_there_are_tensions(tmp_path):
    kwargs = "{{n_tendons: 4, representation: raw, physics: mujoco, episode_steps: 8, "
    kwargs += "max_cocontraction_m: {}}}"
    shares = [
        run(tmp_path / name, **{"env.kwargs": kwargs.format(most), "total_steps": "256"})["slack"]
        for name, most in (("little", "1.0e-6"), ("much", "1.0e-2"))
    ]
    assert (shares[0] >= 0.0).all()
    assert shares[0].max() < shares[1].min() <= 1.0


def test_looking_changes_nothing(tmp_path, monkeypatch):
    run(tmp_path / "seen")
    monkeypatch.setattr(Diagnostics, "after_step", lambda self: None)
    unseen = run(tmp_path / "unseen")
    assert "command_off" not in unseen
    for name in ("evals.npz", "policy/policy.safetensors"):
        seen = (tmp_path / "seen" / name).read_bytes()
        assert seen == (tmp_path / "unseen" / name).read_bytes()
