"""The table of algorithms: every entry can be named, configured and, where installed, trained."""

import pytest

from agents.files import ROOT, ConfigError
from agents.learning import algorithms
from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import TrainConfig, load_config


@pytest.mark.parametrize("name", ALGORITHMS)
def test_every_algorithm_has_a_file_and_a_class_that_takes_its_settings(name, tmp_path):
    if not ALGORITHMS[name].installed:
        pytest.skip(f"{ALGORITHMS[name].module} is not installed")
    (tmp_path / "run.yaml").write_text(f"algo: {name}")
    config = load_config(TrainConfig, tmp_path / "run.yaml")
    assert isinstance(config.algo, ALGORITHMS[name].settings)
    assert (ROOT / "configs" / "algos" / f"{name}.yaml").exists()
    from agents.learning.models import make_model, make_training_env

    model = make_model(config, make_training_env(config))
    assert type(model) is ALGORITHMS[name].load_class()
    assert model.learning_rate == config.algo.learning_rate


def test_a_library_that_is_not_installed_is_named_before_anything_runs(monkeypatch, tmp_path):
    monkeypatch.setattr(algorithms.importlib.util, "find_spec", lambda _: None)
    (tmp_path / "run.yaml").write_text("algo: tqc")
    with pytest.raises(ConfigError, match=r"algo: .*sb3_contrib.*pip install --group contrib"):
        load_config(TrainConfig, tmp_path / "run.yaml")


def test_a_learning_rate_that_falls_reaches_its_end(tmp_path):
    from agents.learning.models import make_model, make_training_env

    (tmp_path / "run.yaml").write_text("algo: {name: ppo, final_learning_rate: 1.0e-5}")
    config = load_config(TrainConfig, tmp_path / "run.yaml")
    schedule = make_model(config, make_training_env(config)).lr_schedule
    assert [schedule(left) for left in (1.0, 0.5, 0.0)] == pytest.approx([1e-3, 5.05e-4, 1e-5])
