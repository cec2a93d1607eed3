"""Noise of a recorded size: the same on the manifold for every representation, and resumed."""

import numpy as np
import pytest

from agents.learning.config import TrainConfig
from agents.learning.training import train

COURSE = [[0, 1.0], [512, 0.5], [1_024, 0.125]]


def config(steps=1_024, **algo):
    small = {"n_steps": 32, "n_epochs": 1, "net_arch": [8], "batch_size": 64}
    return TrainConfig.model_validate(
        {
            "env": {"num_envs": 4, "kwargs": {"n_tendons": 5, "representation": "raw"}},
            "algo": {"name": "ppo", "noise_course": COURSE, **small, **algo},
            "total_steps": steps,
            "evaluation": {"every_steps": 256, "n_goals": 50},
            "checkpoint_every_steps": 256,
        }
    )


def diagnostics(folder):
    with np.load(folder / "diagnostics.npz") as arrays:
        return dict(arrays)


@pytest.mark.parametrize("representation", ["raw", "clarke", "raw_scaled"])
def test_noise_on_the_manifold_follows_the_course_in_every_representation(tmp_path, representation):
    run = config()
    env = run.env.model_copy(update={"kwargs": {"representation": representation, "n_tendons": 5}})
    train(run.model_copy(update={"env": env}), tmp_path / "run")
    rows = diagnostics(tmp_path / "run")
    begun = rows["env_steps"] - 128  # a row tells of the rollout before it
    expected = np.exp(np.interp(begun, *np.transpose([(s, np.log(x)) for s, x in COURSE])))
    np.testing.assert_allclose(rows["std_on"], expected, rtol=1e-6)
    assert np.ptp(rows["log_std"], axis=1).max() == 0.0


def test_an_extended_run_goes_on_along_the_course(tmp_path):
    train(config(512), tmp_path / "parts")
    train(config(1_024), tmp_path / "parts")
    train(config(1_024), tmp_path / "whole")
    for name in ("evals.npz", "policy/policy.safetensors"):
        assert (tmp_path / "parts" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_impossible_courses_are_said():
    with pytest.raises(ValueError, match=r"rising steps, got \[5, 5\]"):
        config(noise_course=[[5, 1.0], [5, 2.0]])
    with pytest.raises(ValueError, match="greater than 0"):
        config(noise_course=[[0, 0.0]])
    with pytest.raises(ValueError, match="does not go with noise=manifold"):
        config(noise="manifold", likelihood="marginal")
