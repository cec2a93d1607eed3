"""Plug-ins of a configuration: imported before it is read, in workers too, and recorded."""

import hashlib
import json
import subprocess
import sys

import pytest
import yaml

from agents.files import ROOT, ConfigError
from agents.learning.config import TrainConfig, load_config
from agents.plugins import allow_plugins, import_plugins
from agents.studies.config import StudyConfig

PLUGIN = """
import gymnasium as gym

gym.register(
    "clarke_gym_test/Slow-v0",
    entry_point="clarke_gym.registration:make_env",
    vector_entry_point="clarke_gym.registration:make_vector_env",
    max_episode_steps=5,
    kwargs={"task": "reach"},
)
"""
RUN = {
    "env": {"id": "clarke_gym_test/Slow-v0", "num_envs": 4, "kwargs": {"n_tendons": 3}},
    "algo": {"name": "ppo", "n_steps": 16, "batch_size": 64, "n_epochs": 1, "net_arch": [8]},
    "total_steps": 128,
    "evaluation": {"every_steps": 64, "n_goals": 50},
    "checkpoint_every_steps": 128,
}
STUDY = {
    "name": "plugged",
    "title": "A study of somebody else's environment",
    "plugins": ["slow_reach"],
    "tuning": "none",
    "representations": [{"label": "raw"}],
    "tasks": [{"label": "slow"}],
    "seeds": [0],
    "base": RUN,
}


def command(folder, *arguments):
    return subprocess.run(
        [sys.executable, str(ROOT / "train.py"), *arguments],
        capture_output=True,
        text=True,
        timeout=240,
        cwd=folder,
    )


def test_a_study_of_an_environment_from_the_working_directory(tmp_path):
    (tmp_path / "slow_reach.py").write_text(PLUGIN)
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(STUDY))
    result = command(
        tmp_path, "study", "--config", "study.yaml", "--out", "out", "--plugins", "slow_reach"
    )
    assert result.returncode == 0, result.stdout + result.stderr
    folder = tmp_path / "out" / "raw_slow" / "seed_00"
    manifest = json.loads((folder / "manifest.json").read_text())
    digest = hashlib.sha256((tmp_path / "slow_reach.py").read_bytes()).hexdigest()
    assert manifest["plugins"] == {"slow_reach": digest}
    shown = command(
        tmp_path, "evaluate", "--run", str(folder), "--goals", "50", "--plugins", "slow_reach"
    )
    assert shown.returncode == 0, shown.stdout + shown.stderr
    assert "success rate" in shown.stdout


def test_a_module_that_does_not_import_is_one_clear_error(tmp_path):
    (tmp_path / "broken.py").write_text("raise RuntimeError('half written')\n")
    for name, reason in (("broken", "RuntimeError: half written"), ("absent", "No module named")):
        (tmp_path / "run.yaml").write_text(yaml.safe_dump({**RUN, "plugins": [name]}))
        result = command(
            tmp_path, "train", "--config", "run.yaml", "--plugins", name, "--out", "out"
        )
        assert result.returncode == 2
        assert result.stderr.startswith("error: ")
        assert f"plug-in '{name}' cannot be imported" in result.stderr
        assert reason in result.stderr
        assert "Slow-v0" not in result.stderr  # what follows from it is not told as well
        assert "Traceback" not in result.stderr
        assert not (tmp_path / "out").exists()


def test_plugins_of_study_and_base_reach_every_run(tmp_path, monkeypatch):
    for name in ("of_the_study", "of_the_base"):
        (tmp_path / f"{name}.py").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    base = RUN | {"env": {"num_envs": 4}, "plugins": ["of_the_base"]}
    allow_plugins(["of_the_study", "of_the_base"])
    study = StudyConfig.model_validate(STUDY | {"plugins": ["of_the_study"], "base": base})
    assert [run.plugins for run in study.runs()] == [["of_the_study", "of_the_base"]]


def test_configurations_without_plugins_say_nothing_of_them(tmp_path):
    """Folders of runs that began before there were plug-ins hold equal configurations."""
    (tmp_path / "run.yaml").write_text("name: a")
    assert "plugins" not in load_config(TrainConfig, tmp_path / "run.yaml").model_dump(mode="json")
    (tmp_path / "run.yaml").write_text("plugins: slow_reach")
    with pytest.raises(ConfigError, match="plugins"):
        load_config(TrainConfig, tmp_path / "run.yaml")


def test_a_module_that_ends_the_process_is_an_error_too(tmp_path, monkeypatch):
    (tmp_path / "leaves.py").write_text("import sys\nsys.exit(0)\n")
    monkeypatch.chdir(tmp_path)
    allow_plugins(["leaves"])
    with pytest.raises(ConfigError, match="'leaves' cannot be imported: SystemExit: 0"):
        import_plugins(["leaves"])
