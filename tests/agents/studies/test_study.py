"""A study around its runs."""

import json

import pytest

from agents.files import ROOT, ConfigError
from agents.learning.algorithms import TD3Settings
from agents.learning.config import load_config
from agents.studies import study
from agents.studies.config import StudyConfig


def test_a_task_that_classical_control_cannot_do_has_no_reference(tmp_path, monkeypatch):
    def refuse(name, env):
        raise ValueError(f"{name} steers the tip to a position")

    monkeypatch.setattr(study, "make_controller", refuse)
    config = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    study.write_references(config, tmp_path)
    assert json.loads((tmp_path / "references.json").read_text()) == {}


def test_references_grow_with_the_tasks(tmp_path):
    study.write_references(small(tmp_path), tmp_path)
    path = tmp_path / "references.json"
    first = json.loads(path.read_text())
    before = path.stat().st_mtime_ns
    study.write_references(small(tmp_path), tmp_path)
    assert path.stat().st_mtime_ns == before
    more = "[{label: n = 3}, {label: n = 5, env: {n_tendons: 5}}]"
    study.write_references(small(tmp_path, tasks=more), tmp_path)
    grown = json.loads(path.read_text())
    assert list(grown) == ["n = 3", "n = 5"]
    assert grown["n = 3"] == first["n = 3"]


SMALL = """
name: small
title: t
tuning: none
baseline: raw
representations: [{label: raw}, {label: clarke, env: {representation: clarke}}]
tasks: [{label: n = 3}]
seeds: [9000, 9001]
base:
  env: {num_envs: 8}
  algo: {name: ppo, n_steps: 16, batch_size: 64, n_epochs: 1}
  total_steps: 256
  checkpoint_every_steps: 256
  evaluation: {every_steps: 128, n_goals: 50}
"""
REGISTERED = """
preregistration:
  {question: q, primary: auc, family: f, rule: r, planned_seeds: 2}
"""


def small(tmp_path, text=SMALL, **changes):
    path = tmp_path / "small_study.yaml"
    path.write_text(text)
    return load_config(StudyConfig, path, changes)


def test_more_seeds_and_arms_run_only_what_is_missing(tmp_path):
    folder = tmp_path / "runs" / "small"
    study.run_study(small(tmp_path), folder, 1)
    before = {p: p.stat().st_mtime_ns for p in folder.rglob("evals.npz")}
    grown = small(
        tmp_path,
        seeds="[9000, 9001, 9002]",
        representations="[{label: raw}, {label: clarke, env: {representation: clarke}}, "
        "{label: modal, env: {action_representation: modal}}]",
    )
    assert "9 runs, 4 finished, 5 to do" in study.plan(grown, folder)
    assert "disk" in study.plan(grown, folder)
    assert study.run_study(grown, folder, 1)["done"] == 5
    after = {p: p.stat().st_mtime_ns for p in folder.rglob("evals.npz")}
    assert len(after) == 9
    assert {p: after[p] for p in before} == before


def test_what_is_there_must_stay(tmp_path):
    path = tmp_path / "study.yaml"
    study.keep_or_grow(path, small(tmp_path))
    text = path.read_text()
    for changes in (
        {"seeds": "[9001]"},
        {"base.total_steps": "128"},
        {"representations": "[{label: raw, algo: {log_std_init: 1.0}}, {label: clarke}]"},
    ):
        with pytest.raises(ConfigError, match="more arms or seeds"):
            study.keep_or_grow(path, small(tmp_path, **changes))
        assert path.read_text() == text


def test_a_preregistered_study_gets_more_seeds_alone(tmp_path):
    registered = small(tmp_path, SMALL + REGISTERED)
    path = tmp_path / "study.yaml"
    study.keep_or_grow(path, registered)
    more = small(tmp_path, SMALL + REGISTERED, seeds="[9000, 9001, 9002]")
    assert more.registered == registered.registered
    study.keep_or_grow(path, more)
    for changes in ({"preregistration.rule": "other"}, {"thresholds.success": "0.5"}):
        with pytest.raises(ConfigError, match="registered"):
            study.keep_or_grow(path, small(tmp_path, SMALL + REGISTERED, **changes))


def test_a_dry_run_writes_nothing(tmp_path):
    folder = tmp_path / "runs" / "small"
    text = study.plan(small(tmp_path, SMALL + REGISTERED), folder)
    assert "2 arms x 2 seeds = 4 runs, 0 finished, 4 to do" in text
    assert "unknown" in text
    assert "preregistered: " in text
    assert not folder.exists()


def test_fresh_seeds_are_no_other_studys(tmp_path):
    with pytest.raises(ConfigError, match=r"seeds \[0\] are not fresh: quick.yaml has used them"):
        small(tmp_path, SMALL + REGISTERED, seeds="[0, 9000]")
    with pytest.raises(ConfigError, match=r"seeds \[500\] are not fresh: tuning.yaml"):
        small(tmp_path, SMALL + REGISTERED, seeds="[500, 9000]")
    stale = {"seeds": "[0, 9000]", "preregistration.fresh": "false"}
    assert small(tmp_path, SMALL + REGISTERED, **stale).seeds == [0, 9000]


def test_a_level_that_names_another_algorithm_begins_from_that_ones_defaults(tmp_path):
    reps = "[{label: raw, algo: {gamma: 0.5}}]"
    tasks = "[{label: n = 3}, {label: td3, algo: {name: td3}}]"
    base = {"base.algo": "{name: sac, tau: 0.5, target_entropy_per_dof: -2.0}"}
    sac, td3 = small(tmp_path, representations=reps, tasks=tasks, seeds="[0]", **base).runs()
    assert (sac.algo.name, sac.algo.tau, sac.algo.gamma) == ("sac", 0.5, 0.5)
    assert (td3.algo.name, td3.algo.tau, td3.algo.gamma) == ("td3", TD3Settings().tau, 0.5)


def test_an_arm_may_run_on_some_tasks_only(tmp_path):
    reps = "[{label: raw}, {label: clarke, only: [n = 4], env: {representation: clarke}}]"
    tasks = "[{label: n = 3}, {label: n = 4, env: {n_tendons: 4}}]"
    found = small(tmp_path, representations=reps, tasks=tasks)
    assert [name for name, _, _ in found.arms()] == ["raw_n3", "raw_n4", "clarke_n4"]
    assert len(found.runs()) == 6
    with pytest.raises(ConfigError, match=r"'clarke' runs only on \['n = 4'\], which is no task"):
        small(tmp_path, representations=reps)


def test_a_failed_run_is_a_result_and_is_not_tried_again_until_its_file_is_deleted(
    tmp_path, capsys
):
    folder = tmp_path / "runs" / "small"
    asked = small(tmp_path, seeds="[9000]")
    study.run_study(asked, folder, 1)
    failed = folder / "raw_n3" / "seed_9000"
    (failed / "DONE").rename(failed / "FAILED")
    assert "1 finished, 1 failed, 0 to do" in study.plan(asked, folder)
    assert study.run_study(asked, folder, 1) == {"failed": 1}  # not a success to who asks again
    told = capsys.readouterr().out
    assert "1 of 2 runs are finished and kept" in told
    assert f"1 failed before: {failed / 'FAILED'} says why" in told
    (failed / "FAILED").unlink()
    assert study.run_study(asked, folder, 1) == {"done": 1}
