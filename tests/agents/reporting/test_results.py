"""Loading run folders: what counts, what is missing, and errors that name file and key."""

import json
import shutil

import numpy as np
import pytest
import yaml

from agents.reporting.loading import load_evals, load_study
from agents.reporting.results import ResultsError

PAIR = {"n = 3": {"raw": 0.9, "clarke": 1.2}}


def rewrite(path, **changes):
    with np.load(path) as file:
        arrays = dict(file)
    arrays = {k: v for k, v in (arrays | changes).items() if v is not None}
    np.savez(path, **arrays)


def test_loads_arms_in_order_with_the_baseline_first(make_study):
    study = load_study(make_study({"b": {"clarke": 1, "raw": 1}, "a": {"raw": 1}}, 2))
    assert study.tasks == ["b", "a"]
    assert study.representations == ["raw", "clarke"]
    assert [arm.representation for arm in study.of_task("b")] == ["raw", "clarke"]
    assert study.threshold == 0.9
    assert study.success(study.arms[0]).shape == (2, 21)


def test_scores_are_means_over_goals(make_study):
    study = load_study(make_study(PAIR, 2))
    arm = study.arms[0]
    evals = arm.done[1][1]
    assert study.success(arm)[1] == pytest.approx(evals.is_success.mean(axis=1))
    metres, percent = arm.metrics
    errors = evals.values["tip_error_m"]
    assert study.curves(arm, metres)[1] == pytest.approx(1000 * errors.mean(axis=1))
    assert study.final(arm, metres)[1] == pytest.approx(1000 * errors[-1])
    assert study.final(arm, percent)[1] == pytest.approx(evals.values["tip_error_percent"][-1])


def test_run_without_marker_or_folder_is_missing(make_study):
    folder = make_study(PAIR)
    (folder / "raw_0" / "seed_00" / "DONE").unlink()
    shutil.rmtree(folder / "raw_0" / "seed_01")
    study = load_study(folder)
    arm = study.arms[0]
    assert [run.status for run in arm.runs] == ["missing", "missing", "done"]
    assert study.success(arm).shape == (1, 21)


def test_failed_run_counts_as_zero_success(make_study):
    folder = make_study(PAIR)
    (folder / "raw_0" / "seed_01" / "DONE").rename(folder / "raw_0" / "seed_01" / "FAILED")
    study = load_study(folder)
    arm = study.arms[0]
    assert arm.count("failed") == 1
    assert not study.success(arm)[1].any()
    assert len(study.curves(arm, arm.metrics[0])) == 2
    assert len(study.final(arm, arm.metrics[0])) == 2


def test_unfinished_evals_are_not_opened(make_study):
    folder = make_study(PAIR)
    run = folder / "raw_0" / "seed_00"
    (run / "DONE").unlink()
    (run / "evals.npz").write_bytes(b"half a file")
    assert load_study(folder).arms[0].count("missing") == 1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("tip_error_m", None),
        ("tip_error_m", np.full((21, 50), np.nan)),
        ("episode_return", np.zeros((21, 49))),
        ("is_success", np.full((21, 50), 0.5)),
        ("env_steps", np.zeros(21, int)),
        ("env_steps", np.arange(20)),
        ("tip_error_percent", np.full((21, 50), "x")),
    ],
)
def test_bad_array_is_named(make_study, key, value):
    path = make_study(PAIR) / "raw_0" / "seed_00" / "evals.npz"
    rewrite(path, **{key: value})
    with pytest.raises(ResultsError, match=r"evals\.npz: key '") as error:
        load_evals(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    "key", ["env_steps", "is_success", "episode_return", "tip_error_m", "tip_error_percent"]
)
def test_pickled_array_is_never_loaded(make_study, key):
    path = make_study(PAIR) / "raw_0" / "seed_00" / "evals.npz"
    rewrite(path, **{key: np.array([{}], dtype=object)})
    with pytest.raises(ResultsError, match=key):
        load_evals(path)


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04 truncated"])
def test_corrupt_npz_is_named(make_study, content):
    folder = make_study(PAIR)
    path = folder / "raw_0" / "seed_00" / "evals.npz"
    path.write_bytes(content)
    with pytest.raises(ResultsError, match="seed_00"):
        load_study(folder)


def test_done_run_without_evals_is_an_error(make_study):
    folder = make_study(PAIR)
    (folder / "raw_0" / "seed_00" / "evals.npz").unlink()
    with pytest.raises(ResultsError, match=r"seed_00.evals\.npz"):
        load_study(folder)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"baseline": None}, "'baseline' has the wrong type"),
        ({"thresholds": {}}, "'success' is missing"),
        ({"thresholds": [0.9]}, "'thresholds' has the wrong type"),
        ({"arms": [{"name": "x"}]}, "arm 0 'x': key 'seeds' is missing"),
        ({"arms": ["x"]}, "arm 0: expected a mapping"),
        ({"arms": [{"name": "x", "representation": "r", "task": "t", "seeds": [0, 0]}]}, "seeds"),
        ({"total_steps": True}, "total_steps"),
    ],
)
def test_bad_study_key_is_named(make_study, change, match):
    folder = make_study(PAIR, **change)
    with pytest.raises(ResultsError, match=match) as error:
        load_study(folder)
    assert "study.yaml" in str(error.value)


def test_broken_or_absent_yaml_is_named(make_study, tmp_path):
    folder = make_study(PAIR)
    (folder / "study.yaml").write_text("a: [")
    for place in (folder, tmp_path / "nowhere"):
        with pytest.raises(ResultsError, match=r"study\.yaml: cannot be read"):
            load_study(place)


def test_two_arms_of_one_task_and_representation_are_refused(make_study):
    folder = make_study(PAIR)
    data = yaml.safe_load((folder / "study.yaml").read_text())
    data["arms"].append(data["arms"][0] | {"name": "clarke_0"})
    (folder / "study.yaml").write_text(yaml.safe_dump(data))
    with pytest.raises(ResultsError, match="'raw' twice"):
        load_study(folder)


def test_unequal_grids_are_refused(make_study):
    folder = make_study(PAIR)
    rewrite(folder / "clarke_0" / "seed_02" / "evals.npz", env_steps=np.arange(21))
    with pytest.raises(ResultsError, match="seed_02"):
        load_study(folder)


def test_study_without_a_finished_run_says_so(make_study):
    folder = make_study(PAIR, 1)
    for marker in folder.glob("*/*/DONE"):
        marker.unlink()
    with pytest.raises(ResultsError, match="no finished run"):
        load_study(folder)


def test_wall_clock_is_interpolated_from_progress(make_study):
    folder = make_study(PAIR, 1)
    path = folder / "raw_0" / "seed_00" / "progress.csv"
    path.write_text("env_steps,wall_s,loss\n100000,50,1\n150000,,2\n200000,250,3\n")
    wall = load_study(folder).arms[0].runs[0].wall_s
    assert wall[[0, 5, 10, 15, 20]].tolist() == [0, 25, 50, 150, 250]


@pytest.mark.parametrize(
    "text", ["", "env_steps,wall_s\n", "a,b\n1,2\n", "env_steps,wall_s\n1,9\n2,3\n"]
)
def test_progress_without_an_honest_clock_offers_none(make_study, text):
    folder = make_study(PAIR, 1)
    (folder / "raw_0" / "seed_00" / "progress.csv").write_text(text)
    assert load_study(folder).arms[0].runs[0].wall_s is None


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("manifest.json", "{"),
        ("manifest.json", "[]"),
        ("progress.csv", "env_steps,wall_s\nx,1\n"),
        ("metrics.json", "{"),
        ("metrics.json", "[]"),
        ("metrics.json", '[{"name": "tip_error_m"}]'),
    ],
)
def test_corrupt_side_file_is_named(make_study, file, text):
    folder = make_study(PAIR, 1)
    (folder / "raw_0" / "seed_00" / file).write_text(text)
    with pytest.raises(ResultsError, match=file):
        load_study(folder)


def test_runs_of_the_first_version_are_read_by_the_names_of_their_arrays(make_study):
    folder = make_study(PAIR, 2)
    declared = load_study(folder)
    for path in folder.glob("*/*/metrics.json"):
        path.unlink()
    study = load_study(folder)
    assert [m.name for m in study.metrics] == ["tip_error_m", "tip_error_percent"]
    assert study.metrics[0].with_unit() == declared.metrics[0].with_unit() == "tip error [mm]"
    for arm, known in zip(study.arms, declared.arms, strict=True):
        values = study.curves(arm, arm.metrics[0])
        np.testing.assert_array_equal(values, declared.curves(known, known.metrics[0]))


def test_runs_of_a_task_that_measured_different_things_are_refused(make_study):
    folder = make_study(PAIR)
    path = folder / "clarke_0" / "seed_01" / "metrics.json"
    path.write_text(json.dumps(json.loads(path.read_text())[:1]))
    with pytest.raises(ResultsError, match=r"seed_01: its metrics differ from other runs of n = 3"):
        load_study(folder)
