"""Tuning gives every arm the same chances, and says what came of each."""

import csv

import pytest
import yaml

from agents.files import ConfigError
from agents.learning.config import load_config
from agents.studies.config import StudyConfig
from agents.studies.tuning import configurations, tune

pytest.importorskip("optuna")

STUDY = """
name: small
title: t
tuning: equal
baseline: raw
search:
  configurations: 2
  seeds: [7]
  space:
    learning_rate: {low: 1.0e-4, high: 1.0e-2, log: true}
    clip_range: {low: 0.1, high: 0.4}
representations: [{label: raw}, {label: clarke, env: {representation: clarke}}]
tasks: [{label: n = 3}]
seeds: [8]
base:
  env: {num_envs: 8}
  algo: {name: ppo, n_steps: 16, batch_size: 64, n_epochs: 1}
  total_steps: 256
  checkpoint_every_steps: 256
  evaluation: {every_steps: 128, n_goals: 50}
"""


def load(tmp_path, **changes):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return load_config(StudyConfig, path, changes)


def test_every_arm_gets_the_same_configurations_and_every_trial_is_published(tmp_path):
    config, folder = load(tmp_path), tmp_path / "tuning"
    assert tune(config, folder)["done"] == 4
    rows = list(csv.DictReader((folder / "tuning.csv").read_text().splitlines()))
    settings = {
        arm: [(row["learning_rate"], row["clip_range"]) for row in rows if row["arm"] == arm]
        for arm in ("raw_n3", "clarke_n3")
    }
    assert settings["raw_n3"] == settings["clarke_n3"]
    assert len(set(settings["raw_n3"])) == 2
    winners = yaml.safe_load((folder / "winners.yaml").read_text())["winners"]
    assert [w["representation"]["label"] for w in winners] == ["raw", "clarke"]
    best = max(float(row["auc"]) for row in rows if row["arm"] == "raw_n3")
    assert winners[0]["auc"] == pytest.approx(best, abs=1e-6)
    import optuna

    backend = optuna.storages.journal.JournalFileBackend(str(folder / "journal.log"))
    names = optuna.get_all_study_names(optuna.storages.JournalStorage(backend))
    assert names == ["raw_n3", "clarke_n3"]
    assert not tune(config, folder)  # nothing is left to do


def test_configurations_fill_the_space_and_come_again(tmp_path):
    search = load(tmp_path, **{"search.configurations": "16"}).search
    found = configurations(search)
    assert found == configurations(search)
    assert len(found) == 16
    assert sum(entry["learning_rate"] < 1e-3 for entry in found) == pytest.approx(8, abs=1)
    assert all(0.1 <= entry["clip_range"] <= 0.4 for entry in found)


def test_what_makes_no_sense_is_said(tmp_path):
    with pytest.raises(ConfigError, match=r"search\.seeds and seeds share \[8\]"):
        load(tmp_path, **{"search.seeds": "[8]"})
    with pytest.raises(ConfigError, match=r"low=2.0 must be below high=1.0"):
        load(tmp_path, **{"search.space": "{clip_range: {low: 2.0, high: 1.0}}"})
    arms = "[{label: raw}, {label: small, algo: {clip_range: 0.2}}]"
    with pytest.raises(ConfigError, match="'small' sets clip_range, which"):
        tune(load(tmp_path, representations=arms), tmp_path / "tuning")
    whole = load(tmp_path, **{"search.space": "{n_epochs: {low: 1.0, high: 9.0}}"})
    with pytest.raises(ValueError, match="n_epochs"):
        tune(whole, tmp_path / "tuning")
    assert not (tmp_path / "tuning").exists()
    config = load(tmp_path).model_copy(update={"search": None})
    with pytest.raises(ConfigError, match="has no search"):
        tune(config, tmp_path / "tuning")
