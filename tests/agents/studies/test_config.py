"""Configurations: every shipped file is valid, every mistake is named."""

from pathlib import Path

import pytest

from agents.files import ROOT, ConfigError
from agents.learning.config import TrainConfig, load_config
from agents.studies.config import StudyConfig

STUDIES = sorted((ROOT / "configs" / "studies").glob("*.yaml"))
TRAINS = sorted((ROOT / "configs" / "train").glob("*.yaml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda p: p.stem)
def test_shipped_studies_are_valid_and_complete(path):
    study = load_config(StudyConfig, path)
    runs = study.runs()
    assert study.name == path.stem
    assert len(runs) == len(study.seeds) * len(study.arms())
    assert len({(run.name, run.seed) for run in runs}) == len(runs)


@pytest.mark.parametrize("path", TRAINS, ids=lambda p: p.stem)
def test_shipped_runs_are_valid(path):
    assert load_config(TrainConfig, path).name == path.stem


def test_quick_study_is_what_the_readme_says():
    study = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    assert [task.env["n_tendons"] for task in study.tasks] == [3, 7, 11]
    assert [rep.label for rep in study.representations] == ["raw", "clarke"]
    assert len(study.seeds) == 5
    assert "smoke" in study.note


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "run.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        ("algo: {name: ppo, learning_rat: 1}", ["algo.ppo.learning_rat", "Extra inputs"]),
        ("algo: {name: dqn}", ["algo", "dqn"]),
        ("algo: nonsense", ["unknown algorithm", "ppo, sac, td3, tqc"]),
        ("env: {kwargs: {n_tendons: 2}}", ["env", "n_tendons must be at least 3, got 2"]),
        ("env: {id: clarke_gym/Nope-v0}", ["Nope"]),
        ("seed: -1\ntotal_steps: 0", ["seed", "total_steps"]),
        ("algo: {name: ppo, learning_rate: .nan}", ["learning_rate"]),
        ("total_steps: 1000", ["multiple of evaluation.every_steps"]),
        ("- a\n- b", ["expected a mapping"]),
        ("a: [", ["run.yaml"]),
        ("name: ../../etc", ["name"]),
    ],
)
def test_mistakes_are_named_all_at_once(tmp_path, text, messages):
    with pytest.raises(ConfigError) as error:
        load_config(TrainConfig, write(tmp_path, text))
    for message in messages:
        assert message in str(error.value)


def test_yaml_is_loaded_safely(tmp_path):
    marker = tmp_path / "marker"
    path = write(tmp_path, f"name: !!python/object/apply:os.system ['touch {marker}']")
    with pytest.raises(ConfigError):
        load_config(TrainConfig, path)
    assert not marker.exists()


def test_updates_that_are_whole_but_for_rounding_are_taken():
    env = {"num_envs": 100, "kwargs": {"n_tendons": 3}}
    algo = {"name": "sac", "updates_per_env_step": 0.29}
    steps = {"total_steps": 10_000, "checkpoint_every_steps": 10_000}
    evaluation = {"every_steps": 10_000, "n_goals": 50}
    run = TrainConfig.model_validate({"env": env, "algo": algo, "evaluation": evaluation, **steps})
    sizes = {"num_envs": 100, "dof": 2, "action": 3, "episode": 50}
    assert run.algo.arguments(sizes)["gradient_steps"] == 29


def test_hindsight_needs_room_for_episodes():
    algo = {"name": "sac", "replay": "her", "buffer_size": 4_096}
    env = {"num_envs": 64, "kwargs": {"goal_env": True}}
    with pytest.raises(ValueError, match="two episodes an environment, 6400 or more, got 4096"):
        TrainConfig.model_validate({"algo": algo, "env": env})
    TrainConfig.model_validate({"algo": algo | {"buffer_size": 6_400}, "env": env})


def test_overrides_reach_nested_keys(tmp_path):
    path = write(tmp_path, "name: a")
    config = load_config(TrainConfig, path, {"env.kwargs.n_tendons": "7", "seed": "3"})
    assert config.env.kwargs == {"n_tendons": 7}
    assert config.seed == 3
    with pytest.raises(ConfigError, match="not a group"):
        load_config(TrainConfig, path, {"name.x": "1"})


def test_study_arms_must_be_consistent(tmp_path):
    text = (ROOT / "configs" / "studies" / "quick.yaml").read_text()
    with pytest.raises(ConfigError, match="baseline"):
        load_config(StudyConfig, write(tmp_path, text.replace("baseline: raw", "baseline: x")))
    with pytest.raises(ConfigError, match="seeds must differ"):
        load_config(StudyConfig, write(tmp_path, text.replace("[0, 1, 2, 3, 4]", "[1, 1]")))


def test_hidden_hyper_parameters_are_neutralised():
    """Protocol, rule 3: entropy per degree of freedom, noise in tip space."""
    for name, expected in (("sac", "target_entropy"), ("td3", "action_noise")):
        config = TrainConfig.model_validate({"algo": {"name": name}, "env": {"num_envs": 8}})
        raw = config.algo.arguments({"dof": 2, "action": 8, "num_envs": 8, "episode": 50})[expected]
        clarke = config.algo.arguments({"dof": 2, "action": 2, "num_envs": 8, "episode": 50})[
            expected
        ]
        assert raw == (clarke if name == "sac" else pytest.approx(2.0 * clarke))


SIGHT = {name: {"env": {"observation_representation": name}} for name in ("raw", "clarke")}
FACTORS = {"noise": {"unit": {}, "small": {"algo": {"log_std_init": -1.0}}}, "sight": SIGHT}
FACTORIAL = {
    "name": "factors",
    "title": "t",
    "baseline": "unit x raw",
    "tuning": "none",
    "factorial": FACTORS,
    "tasks": [{"label": "n = 3", "env": {"n_tendons": 3}}],
    "seeds": [0],
    "base": {"algo": {"name": "ppo"}},
}


def test_a_factorial_study_has_every_combination_of_levels():
    study = StudyConfig.model_validate(FACTORIAL)
    arms = {arm.label: arm for _, arm, _ in study.arms()}
    assert list(arms) == ["unit x raw", "unit x clarke", "small x raw", "small x clarke"]
    arm = arms["small x clarke"]
    assert (arm.env, arm.algo) == (SIGHT["clarke"]["env"], {"log_std_init": -1.0})
    assert len({name for name, _, _ in study.arms()}) == 4
    again = study.model_dump(mode="json")  # a study's folder holds it written out
    assert StudyConfig.model_validate(again) == study


@pytest.mark.parametrize(
    ("factors", "message"),
    [
        ({"a": SIGHT, "b": SIGHT}, "sets observation_representation by two factors"),
        ({"a": {"x": {"robot": 1}}}, "level 'x' must change env or algo"),
        ({"a": {"x": {"env": None}}}, "level 'x' must change env or algo"),
        ({"a": {}}, "factors, each with levels"),
        (3, "factors, each with levels"),
    ],
)
def test_impossible_factors_are_said(factors, message):
    with pytest.raises(ValueError, match=message):
        StudyConfig.model_validate(FACTORIAL | {"factorial": factors})


@pytest.mark.parametrize("name", ["num_envs", "autoreset_mode", "vectorization_mode"])
def test_what_training_sets_is_no_keyword_of_the_environment(tmp_path, name):
    (tmp_path / "run.yaml").write_text(f"env: {{kwargs: {{{name}: 3}}}}")
    with pytest.raises(ConfigError, match=rf"env: .*kwargs cannot hold \['{name}'\]"):
        load_config(TrainConfig, tmp_path / "run.yaml")
