"""Training: determinism, the adapter, checkpoints, held-out evaluation, studies that die."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import torch
from PIL import Image

from agents.files import ROOT, ConfigError
from agents.learning.acting import RandomAgent, evaluate_run
from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import EnvSettings, TrainConfig
from agents.learning.evaluation import HELD_OUT_SEED, HeldOutEvaluation
from agents.learning.models import TRAINING_SEED_LIMIT, make_model, make_training_env
from agents.learning.play import play
from agents.learning.training import train
from agents.studies.executors import carry_out

TINY = {
    "name": "tiny",
    "env": {"num_envs": 4, "kwargs": {"n_tendons": 5, "representation": "clarke"}},
    "algo": {"name": "ppo", "n_steps": 64, "batch_size": 64, "n_epochs": 2, "net_arch": [16]},
    "total_steps": 1024,
    "evaluation": {"every_steps": 512, "n_goals": 50},
    "checkpoint_every_steps": 512,
}
OFF_POLICY = {
    name: TINY
    | {
        "algo": {"name": name, "learning_starts": 64, "batch_size": 32, "net_arch": [16]},
        "total_steps": 256,
        "evaluation": {"every_steps": 128, "n_goals": 50},
        "checkpoint_every_steps": 128,
    }
    for name in ("sac", "td3", "tqc")
}
CONFIGS = {"ppo": TINY, **OFF_POLICY}
ALGOS = [
    pytest.param(
        name,
        marks=pytest.mark.skipif(
            not ALGORITHMS[name].installed, reason=f"{ALGORITHMS[name].module} is not installed"
        ),
    )
    for name in sorted(CONFIGS)
]


def config(**changes):
    return TrainConfig.model_validate(TINY | changes)


@pytest.mark.parametrize("algo", ALGOS)
def test_equal_runs_give_equal_bytes_and_a_finished_run_is_kept(tmp_path, algo):
    settings = TrainConfig.model_validate(CONFIGS[algo])
    assert train(settings, tmp_path / "a")
    assert train(settings, tmp_path / "b")
    first = (tmp_path / "a" / "evals.npz").read_bytes()
    assert first == (tmp_path / "b" / "evals.npz").read_bytes()
    assert np.load(tmp_path / "a" / "evals.npz")["goal_position_m"].shape == (50, 3)
    stamp = (tmp_path / "a" / "policy" / "policy.safetensors").stat().st_mtime_ns
    assert not train(settings, tmp_path / "a")
    assert (tmp_path / "a" / "policy" / "policy.safetensors").stat().st_mtime_ns == stamp
    for name in (
        "config.yaml",
        "manifest.json",
        "progress.csv",
        "tensorboard",
        "checkpoint",
        "policy",
    ):
        assert (tmp_path / "a" / name).exists()


@pytest.mark.parametrize("algo", ALGOS)
def test_a_run_continued_from_its_checkpoint_equals_one_that_was_never_stopped(tmp_path, algo):
    """Stop after the checkpoint in the middle; the rest must not notice."""
    settings = TrainConfig.model_validate(CONFIGS[algo])
    train(settings, tmp_path / "whole")

    class Stop(Exception):
        pass

    done = 0

    def interrupt(steps):
        nonlocal done
        done += steps
        if done > settings.total_steps * 0.6:
            raise Stop

    with pytest.raises(Stop):
        train(settings, tmp_path / "halves", interrupt)
    assert not (tmp_path / "halves" / "DONE").exists()
    seen = []
    train(settings, tmp_path / "halves", seen.append)
    assert seen[0] == settings.total_steps // 2  # it continued
    assert sum(seen) == settings.total_steps
    whole, halves = (np.load(tmp_path / name / "evals.npz") for name in ("whole", "halves"))
    for key in whole:
        np.testing.assert_array_equal(whole[key], halves[key])


def test_a_folder_of_another_configuration_is_left_alone(tmp_path):
    train(config(), tmp_path)
    before = (tmp_path / "config.yaml").read_text()
    with pytest.raises(ConfigError, match=r"another configuration.*seed"):
        train(config(seed=1), tmp_path)
    assert (tmp_path / "config.yaml").read_text() == before


def test_held_out_goals_are_fixed_disjoint_and_leave_training_untouched():
    settings = EnvSettings(kwargs={"n_tendons": 5, "representation": "clarke"})
    evaluation = HeldOutEvaluation(settings, 60)
    first = evaluation.run(RandomAgent(2))
    training = make_training_env(config())
    training.seed(0)
    training.reset()
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    torch_state = torch.get_rng_state()
    second = evaluation.run(RandomAgent(2))
    for key in first:
        np.testing.assert_array_equal(first[key], second[key])
    np.testing.assert_array_equal(state, np.random.get_state()[1])  # noqa: NPY002
    assert torch.equal(torch_state, torch.get_rng_state())
    assert HELD_OUT_SEED > TRAINING_SEED_LIMIT
    assert first["is_success"].shape == (60,)
    goals = evaluation.goal_positions()
    np.testing.assert_array_equal(goals, evaluation.env.unwrapped.goal)  # Reach: they stay
    assert len(np.unique(goals, axis=0)) == 60


@pytest.mark.parametrize(
    ("task", "places"), [("Pose", slice(0, 3)), ("Shape", slice(-3, None)), ("Nest", slice(0, 3))]
)
def test_goals_of_several_numbers_are_where_the_tip_should_be(task, places):
    evaluation = HeldOutEvaluation(EnvSettings(id=f"clarke_gym/{task}-v0"), 3)
    goals = evaluation.goal_positions()
    np.testing.assert_array_equal(goals, evaluation.env.unwrapped.goal[:, places])
    evaluation.close()


def test_goals_that_move_have_no_place():
    assert HeldOutEvaluation(EnvSettings(id="clarke_gym/Track-v0"), 3).goal_positions() is None


def test_runs_of_different_seeds_share_no_training_episode():
    ranges = []
    for seed in (0, 1, 9_999):
        settings = config(seed=seed)
        env = make_training_env(settings)
        make_model(settings, env)
        ranges.append(set(env._seeds))
        assert max(env._seeds) < TRAINING_SEED_LIMIT
    assert len(set.union(*ranges)) == 3 * settings.env.num_envs


def test_ppo_learns_and_the_command_line_evaluates_it(tmp_path):
    settings = config(
        # A render mode that training accepts does not get in the way of `play`.
        env={
            "num_envs": 16,
            "kwargs": {"n_tendons": 5, "representation": "clarke", "render_mode": "rgb_array"},
        },
        algo={"name": "ppo"},
        total_steps=15_360,
        evaluation={"every_steps": 5_120, "n_goals": 50},
        checkpoint_every_steps=5_120,
    )
    train(settings, tmp_path)
    evals = np.load(tmp_path / "evals.npz")
    np.testing.assert_array_equal(evals["env_steps"], [0, 5_120, 10_240, 15_360])
    error = np.median(evals["tip_error_percent"], axis=1)
    assert error[-1] < 0.2 * error[0]
    table = evaluate_run(tmp_path, "policy", 50)
    assert f"{evals['is_success'][-1].mean():8.3f}" in table
    assert "random" in evaluate_run(tmp_path, "random", 50)
    assert "success rate          1.000" in evaluate_run(tmp_path, "clarke_controller", 50)
    with pytest.raises(ValueError, match=r"one of \['policy', 'random'"):
        evaluate_run(tmp_path, "oracle", 50)
    try:
        assert play(tmp_path, "policy", tmp_path / "a.gif", episodes=1, size=48) == 50
        with Image.open(tmp_path / "a.gif") as picture:
            lasts = 0
            for frame in range(picture.n_frames):
                picture.seek(frame)
                lasts += picture.info["duration"]
        assert lasts == 50 * 50
    except RuntimeError as error:
        pytest.skip(str(error))  # no off-screen OpenGL; the rest has been tested
    with Image.open(tmp_path / "a.gif") as picture:
        assert picture.n_frames > 5  # equal neighbours are merged
    with pytest.raises(ConfigError, match="exists and is kept"):
        play(tmp_path, "policy", tmp_path / "a.gif")


STUDY = """
name: killed
title: A study that dies
note: test
tuning: none
representations:
  - {label: raw, env: {representation: raw}}
  - {label: clarke, env: {representation: clarke}}
tasks: [{label: n = 3, env: {n_tendons: 3}}]
seeds: [0, 1]
base:
  env: {num_envs: 16}
  algo: {name: ppo, n_steps: 32, batch_size: 64, net_arch: [16]}
  total_steps: 4096
  evaluation: {every_steps: 1024, n_goals: 50}
  checkpoint_every_steps: 2048
"""


def test_a_killed_study_completes_and_finished_runs_are_not_redone(tmp_path):
    (tmp_path / "killed.yaml").write_text(STUDY)
    out = tmp_path / "runs"
    command = [sys.executable, str(ROOT / "train.py"), "study", "--config"]
    command += [str(tmp_path / "killed.yaml"), "--out", str(out), "--workers", "1"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    deadline = time.monotonic() + 300
    while not list(out.glob("*/*/DONE")) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    kept = {path: path.stat().st_mtime_ns for path in out.glob("*/*/DONE")}
    assert 1 <= len(kept) < 4
    time.sleep(5.0)  # the orphaned worker notices and ends
    again = subprocess.run(command, capture_output=True, text=True, timeout=240)
    assert again.returncode == 0, again.stdout + again.stderr
    assert f"{len(kept)} of 4 runs are finished and kept" in again.stdout
    assert len(list(out.glob("*/*/DONE"))) == 4
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    reference = json.loads((out / "references.json").read_text())["n = 3"]
    assert reference["agent"] == "clarke_controller"
    assert reference["success_rate"] == 1.0
    report = subprocess.run(
        [sys.executable, str(ROOT / "train.py"), "report", "--study", str(out)],
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert report.returncode == 0, report.stdout + report.stderr
    assert (out / "report" / "report.html").stat().st_size > 10_000


def test_noise_that_collapses_is_a_result_and_no_fault_of_the_machine(tmp_path):
    algo = TINY["algo"] | {"likelihood": "marginal", "log_std_init": -60.0}
    kwargs = {"n_tendons": 7, "representation": "raw_scaled"}
    settings = config(algo=algo, env={"num_envs": 4, "kwargs": kwargs})
    assert carry_out((settings, tmp_path / "run"), lambda _: None)[0] == "failed"
    assert (tmp_path / "run" / "FAILED").exists()


def test_a_run_that_is_not_finished_is_not_evaluated(tmp_path):
    train(config(), tmp_path / "run")
    (tmp_path / "run" / "DONE").unlink()
    with pytest.raises(ConfigError, match="is not finished"):
        evaluate_run(tmp_path / "run", "policy", 10)
    assert "success rate" in evaluate_run(tmp_path / "run", "random", 10)
