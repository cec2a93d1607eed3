"""Bad input: each one line on stderr, exit code 2, and nothing written."""

import pytest
import yaml

import train as command_line
from agents.learning.config import TrainConfig, load_config
from agents.learning.training import train
from agents.studies.config import StudyConfig
from tests.attack.world import RUNS, STUDY, tree

TINY = RUNS["ppo"] | {"total_steps": 128}

CONFIGS = {
    "empty": ("", "an empty file"),
    "comment": ("# nothing", "an empty file"),
    "broken": ("a: [", "expected the node content"),
    "list": ("- a", "expected a mapping"),
    "text": ("hello", "expected a mapping"),
    "binary": (b"\xff\xfe\x00", "UTF-8"),
    "control": (b"a: \x07", "special characters"),
    "tag": ("a: !!python/object/apply:os.system [ls]", "constructor"),
    "twice": ("seed: 1\nseed: 2", "stands there twice"),
    "unhashable": ("{[a]: 1}", "unhashable"),
    "date": ("seed: 2024-13-45", "month"),
    "alias": ("a: &a [[1]]\nb: *a", "write the value out"),
    "unknown key": ("colour: red", "colour: Extra inputs"),
    "unknown algorithm": ("algo: dqn", "known are ppo, sac, td3, tqc"),
    "unknown name": ("algo: {name: dqn}", "'ppo'"),
    "algo path": ("algo: ../../x", "unknown algorithm"),
    "algo number": ("algo: 3", "algo"),
    "seed": ("seed: -1", "seed"),
    "seed float": ("seed: 0.5", "seed"),
    "seed text": ("seed: one", "seed"),
    "seed truth": ("seed: true", "seed must not be true or false"),
    "rate truth": ("algo: {name: ppo, learning_rate: yes}", "must not be true or false"),
    "entropy off": ("algo: {name: sac, target_entropy_per_dof: off}", "must not be true or false"),
    "layer truth": ("algo: {name: ppo, net_arch: [true]}", "must not be true or false"),
    "twice told": ("env: {kwargs: {autoreset_mode: disabled}}", "autoreset_mode"),
    "batch of one": ("algo: {name: ppo, batch_size: 1}", "must be 2 or more"),
    "checker": ("env: {kwargs: {disable_env_checker: true}}", "disable_env_checker"),
    "window": ("env: {kwargs: {render_mode: human}}", "render_mode"),
    "steps": ("total_steps: 0", "total_steps"),
    "steps nan": ("total_steps: .nan", "total_steps"),
    "steps infinite": ("total_steps: .inf", "total_steps"),
    "off the grid": ("total_steps: 10000", "the nearest: 10240"),
    "num_envs": ("env: {num_envs: 33}", "the nearest env.num_envs that do: 32, 40"),
    "num_envs zero": ("env: {num_envs: 0}", "num_envs"),
    "name": ("name: ../../etc", "name"),
    "long name": ("name: " + "x" * 300, "name"),
    "id": ("env: {id: 'os:Reach-v0'}", "no environment of this package"),
    "foreign id": ("env: {id: CartPole-v1}", "no environment of this package"),
    "kwargs": ("env: {kwargs: {n_tendon: 3}}", "n_tendon"),
    "kwargs list": ("env: {kwargs: {n_tendons: [3]}}", "n_tendons"),
    "few goals": ("evaluation: {n_goals: 3}", "n_goals"),
    "learning rate": ("algo: {name: ppo, learning_rate: .nan}", "learning_rate"),
    "gamma": ("algo: {name: ppo, gamma: 2}", "gamma"),
    "layers": ("algo: {name: ppo, net_arch: [0]}", "net_arch"),
    "updates": ("algo: {name: sac, updates_per_env_step: 0.01}", "the nearest that is whole"),
    "her": ("algo: {name: sac, replay: her}", "needs env.kwargs.goal_env=true"),
    "replay": ("algo: {name: sac, replay: best}", "replay"),
    "old setting": ("algo: {name: sac, gradient_steps: 1}", "gradient_steps"),
    "plug-in": ("plugins: [os]", "add --plugins os"),
    "plug-ins": ("plugins: os", "plugins"),
}

SETTINGS = {
    "bad yaml": (["--set", "seed", "["], "--set seed"),
    "alias": (["--set", "seed", "*a"], "undefined alias"),
    "twice": (["--set", "seed", "1", "--set", "seed", "2"], "--set gives seed twice"),
    "twice in one": (["--set", "seed", "1", "seed", "2"], "--set gives seed twice"),
    "both ways": (["--seed", "1", "--set", "seed", "2"], "given twice"),
    "no group": (["--set", "name.x", "1"], "not a group"),
    "algorithm": (["--set", "algo", "dqn"], "known are ppo"),
    "no file": (["--config", "none.yaml"], "none.yaml"),
}

STUDIES = {
    "threshold": ({"thresholds": {"success": float("nan")}}, "success"),
    "threshold high": ({"thresholds": {"success": 2}}, "success"),
    "baseline": ({"baseline": "best"}, "baseline must be one of"),
    "seeds": ({"seeds": [1, 1]}, "seeds must differ"),
    "no seeds": ({"seeds": []}, "seeds"),
    "collision": ({"representations": [{"label": "raw"}, {"label": "r aw"}]}, "share the folder"),
    "equal": ({"representations": [{"label": "raw"}, {"label": "raw"}]}, "different labels"),
    "no label": ({"tasks": [{"label": ""}]}, "label"),
    "dots": ({"tasks": [{"label": "../../x"}], "seeds": [-1]}, "seed"),
    "plug-in": ({"plugins": ["os"]}, "add --plugins os"),
}


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Return a check of arguments: exit code 2, one line with the text, nothing written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(command_line.signal, "signal", lambda *_: None)  # the tests' own stay

    def check(arguments, text):
        before = tree(tmp_path)
        assert command_line.main(arguments) == 2
        error = capsys.readouterr().err
        assert error.startswith("error: ")
        assert error.count("\n") == 1, error
        assert text in error, error
        assert tree(tmp_path) == before

    return check


@pytest.mark.parametrize("name", CONFIGS)
def test_a_bad_configuration_is_one_line(tmp_path, refused, name):
    content, text = CONFIGS[name]
    data = content if isinstance(content, bytes) else content.encode()
    (tmp_path / "run.yaml").write_bytes(data)
    refused(["train", "--config", "run.yaml", "--out", "out"], text)


@pytest.mark.parametrize("name", SETTINGS)
def test_a_bad_setting_is_one_line(refused, name):
    arguments, text = SETTINGS[name]
    refused(["train", "--out", "out", *arguments], text)


@pytest.mark.parametrize("name", STUDIES)
def test_a_bad_study_is_one_line(tmp_path, refused, name):
    changes, text = STUDIES[name]
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(STUDY | changes))
    refused(["study", "--config", "study.yaml", "--out", "out"], text)


def test_bad_arguments_of_a_finished_run_are_one_line(tmp_path, refused):
    train(TrainConfig.model_validate(TINY), tmp_path / "run")
    (tmp_path / "kept.gif").write_text("mine")
    (tmp_path / "user").mkdir()
    (tmp_path / "user" / "thesis.tex").write_text("mine")
    (tmp_path / "run.yaml").write_text(yaml.safe_dump(TINY | {"seed": 5}))
    for arguments, text in (
        (["evaluate", "--run", "run", "--goals", "0"], "--goals"),
        (["evaluate", "--run", "run", "--goals", "1000000000"], "--goals"),
        (["evaluate", "--run", "run", "--agent", "oracle"], "agent must be one of"),
        (["evaluate", "--run", "user"], "config.yaml"),
        (["play", "--run", "run", "--episodes", "0"], "--episodes"),
        (["play", "--run", "run", "--out", "a.avi"], ".gif or .mp4"),
        (["play", "--run", "run", "--out", "kept.gif"], "exists and is kept"),
        (["train", "--config", "run.yaml", "--out", "run"], "another configuration"),
        (["train", "--config", "run.yaml", "--out", "user"], "not this program's folder"),
        (["train", "--config", "run.yaml", "--out", "kept.gif"], "Not a directory"),
        (["study", "--workers", "0", "--out", "o"], "--workers"),
        (["study", "--out", "user"], "not this program's folder"),
        (["report", "--study", "user"], "study.yaml"),
    ):
        refused(arguments, text)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("references.json", "{"),
        ("references.json", "[1]"),
        ("references.json", '{"n = 3": {"agent": "a", "success_rate": "high"}}'),
        ("references.json", '{"n = 3": {"agent": "a", "success_rate": NaN}}'),
        ("study.yaml", "thresholds: {success: .nan}"),
        ("raw_n3/seed_00/evals.npz", "no arrays"),
        ("raw_n3/seed_00/manifest.json", "{"),
    ],
)
def test_a_corrupt_file_of_a_study_is_one_line(tmp_path, refused, name, content):
    study = StudyConfig.model_validate(STUDY)
    for run in study.runs():
        train(run.model_copy(update={"total_steps": 128}), tmp_path / run.name / "seed_00")
    data = study.resolved()
    if name == "study.yaml":
        data["thresholds"] = {"success": float("nan")}
    (tmp_path / "study.yaml").write_text(yaml.safe_dump(data))
    if name != "study.yaml":
        (tmp_path / name).write_text(content)
    refused(["report", "--study", "."], name)


def test_what_is_good_is_understood(tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text(
        "total_steps: 3e4\nevaluation: {every_steps: 1000, n_goals: 50}\n"
        "env: {num_envs: 10}\nalgo: {name: sac}\ncheckpoint_every_steps: 1e4"
    )
    assert load_config(TrainConfig, path).total_steps == 30_000
    path.write_text("name: a")
    config = load_config(TrainConfig, path, {"algo.gamma": "0.9", "algo": "sac"})
    assert (config.algo.name, config.algo.gamma) == ("sac", 0.9)
    merged = command_line._merged(["train", "--plugins", "p", "--set=b", "2", "--plugins=q"])
    assert merged == ["train", "--set", "b", "2", "--plugins", "p", "q"]
    merged = command_line._merged(["train", "--set", "a", "-1", "--set", "b", "2"])
    assert merged == ["train", "--set", "a", "-1", "b", "2"]


def test_default_configurations_are_found_from_any_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert command_line._found(command_line.Train.config).is_file()
    assert command_line._found(command_line.Study.config).is_file()
