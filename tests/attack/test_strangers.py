"""Files of strangers: nothing in them is executed, nothing fills the memory."""

import pickle
import time
from contextlib import suppress

import pytest
import yaml

from agents.files import ConfigError
from agents.learning.acting import evaluate_run
from agents.learning.config import TrainConfig, load_config
from agents.learning.training import train
from agents.reporting.cells import from_cell, to_cell
from agents.reporting.tables import plain
from agents.studies.config import StudyConfig
from agents.yaml_files import parse_yaml, yaml_text
from tests.attack.world import RUNS, STUDY, popen

CONFIG = TrainConfig.model_validate(RUNS["sac"] | {"total_steps": 256})


class Hostile:
    def __init__(self, marker):
        self.marker = marker

    def __reduce__(self):
        return open, (str(self.marker), "w")


def test_a_hostile_pickle_in_every_file_of_a_run_executes_nothing(tmp_path, monkeypatch, figure):
    folder, marker = tmp_path / "run", tmp_path / "executed"
    train(CONFIG, folder)
    payload = pickle.dumps(Hostile(marker))
    names = [path for path in folder.rglob("*") if path.is_file() and path.name != ".lock"]
    newest = max((folder / "checkpoint").iterdir())
    names += [folder / "model.zip", newest / "state.pkl", newest / "replay_buffer.pkl"]
    executed = 0
    for path in names:
        old = path.read_bytes() if path.exists() else None
        done = (folder / "DONE").read_bytes()
        path.write_bytes(payload)
        for act in (lambda: evaluate_run(folder, "policy", 1), lambda: train(CONFIG, folder)):
            with suppress(ConfigError, ValueError, OSError):
                act()
            (folder / "DONE").unlink(missing_ok=True)  # the second act resumes
        executed += marker.exists()
        if old is None:
            path.unlink()
        else:
            path.write_bytes(old)
        (folder / "DONE").write_bytes(done)
    assert executed == 0
    figure(f"hostile pickles in {len(names)} files: {executed} executed")


def test_models_of_version_0_1_are_not_read(tmp_path):
    train(CONFIG, tmp_path)
    (tmp_path / "policy" / "policy.safetensors").rename(tmp_path / "model.zip")
    with pytest.raises(ConfigError, match=r"model.zip of version 0.1: a pickle"):
        evaluate_run(tmp_path, "policy", 1)


def test_an_environment_id_imports_no_module(tmp_path, monkeypatch):
    (tmp_path / "evil.py").write_text("open('executed', 'w')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    for id in ("evil:Reach-v0", "CartPole-v1", "GymV21Environment-v0", "Nope-v0"):
        with pytest.raises(ValueError, match="no environment of this package or of a plug-in"):
            TrainConfig.model_validate({"env": {"id": id}})
    with pytest.raises(ValueError, match=r"add --plugins evil"):
        TrainConfig.model_validate({"plugins": ["evil"]})
    assert not (tmp_path / "executed").exists()


def test_an_environment_without_a_vector_entry_point_is_said(tmp_path):
    (tmp_path / "scalar_only.py").write_text(
        "import gymnasium as gym\n"
        "gym.register('mine/Scalar-v0', entry_point='clarke_gym.registration:make_env')\n"
    )
    (tmp_path / "run.yaml").write_text("plugins: [scalar_only]\nenv: {id: mine/Scalar-v0}")
    with popen(
        "train", "--config", "run.yaml", "--plugins", "scalar_only", cwd=tmp_path
    ) as process:
        error = process.stderr.read()
    assert process.returncode == 2
    assert "registered without vector_entry_point" in error
    assert error.count("\n") == 1


def test_alias_bombs_are_refused_at_once():
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 10)]
    long = f"a: &a [{', '.join('1' * 5_000)}]\nb: [{', '.join(['*a'] * 5_000)}]"
    for bomb in ("\n".join(lines), long, "[" * 50_000, "x" * 2_000_000):
        began = time.process_time()
        with pytest.raises(ConfigError) as error:
            parse_yaml(bomb, "bomb")
        assert time.process_time() - began < 2.0
        assert "\n" not in str(error.value)


def test_what_is_written_is_read_back_equal():
    data = {"a": "3e4", "b": 3e4, "c": "1", "d": "yes", "e": [[1, 2], [1, 2]], "f": None, "g": "é"}
    assert parse_yaml(yaml_text(data), "") == data
    seeds = [0, 1]
    old = yaml.safe_dump({"seeds": seeds, "arms": [{"seeds": seeds}, {"seeds": seeds}]})
    assert "*id" in old  # as version 0.1 wrote study.yaml
    assert parse_yaml(old, "")["arms"][1]["seeds"] == seeds


@pytest.mark.parametrize(
    "change",
    [
        {"env": {"num_envs": 10**9}},
        {"total_steps": 10**18},
        {"evaluation": {"every_steps": 10_240, "n_goals": 10**9}},
        {"algo": {"name": "ppo", "n_steps": 10**9}},
        {"algo": {"name": "ppo", "net_arch": [10**9]}},
        {"algo": {"name": "ppo", "net_arch": [8] * 1_000}},
        {"algo": {"name": "sac", "buffer_size": 10**12}},
        {"algo": {"name": "sac", "updates_per_env_step": 1e9}},
    ],
)
def test_counts_have_ceilings(change):
    with pytest.raises(ValueError, match=r"less than or equal|at most"):
        TrainConfig.model_validate(change)
    with pytest.raises(ValueError, match="seeds"):
        StudyConfig.model_validate(STUDY | {"seeds": list(range(10_001))})


def test_labels_cannot_act_in_tables():
    assert plain("<script>alert(1)</script>").startswith("&lt;script&gt;")
    assert plain("a|b\nc") == "a\\|b c"
    for label in ("=cmd|' /C calc'!A0", "+1", "-1", "@x", "\tx"):
        assert to_cell(label) == "'" + label
        assert from_cell(to_cell(label)) == label
    assert to_cell("raw") == "raw"


def test_compressed_or_pickled_arrays_are_refused(tmp_path):
    import io

    import numpy as np

    from agents.files import read_npz

    for save, arrays in ((np.savez_compressed, np.zeros(10)), (np.savez, np.array([{}]))):
        buffer = io.BytesIO()
        save(buffer, a=arrays)
        with pytest.raises(ValueError, match=r"compressed|allow_pickle"):
            read_npz(buffer.getvalue())


def test_the_shipped_configurations_are_read_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for text in ("algo: sac", "algo: {name: td3}"):
        (tmp_path / "run.yaml").write_text(text)
        assert load_config(TrainConfig, tmp_path / "run.yaml")


def test_a_checkpoint_of_version_0_1_is_said_and_the_run_starts_again(tmp_path, capsys):
    train(CONFIG, tmp_path)
    (tmp_path / "DONE").unlink()
    for path in (tmp_path / "checkpoint").iterdir():
        for name in ("manifest.json", "state.json"):
            (path / name).unlink()
        (path / "state.pkl").write_bytes(pickle.dumps(Hostile(tmp_path / "executed")))
    assert train(CONFIG, tmp_path)
    assert "written by version 0.1 with pickle" in capsys.readouterr().err
    assert not (tmp_path / "executed").exists()
