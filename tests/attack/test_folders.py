"""Nothing of the user's is deleted, replaced or reached through a link."""

import os
import time

import numpy as np
import pytest
import yaml

from agents import files
from agents.files import ConfigError
from agents.learning.config import TrainConfig
from agents.learning.training import LearningFailure, train
from agents.reporting import report
from agents.reporting.loading import load_run, load_study
from agents.reporting.report import write_report
from agents.reporting.results import ResultsError
from agents.studies.config import StudyConfig
from agents.studies.study import run_study
from tests.attack.world import RUNS, STUDY, popen, tree, write

CONFIG = TrainConfig.model_validate(RUNS["ppo"] | {"total_steps": 128})


@pytest.mark.parametrize(
    "name",
    ["checkpoint/thesis/a.txt", "manifest.json", "model.zip", "progress.csv", "evals.npz", "x"],
)
def test_a_folder_of_somebody_is_refused_and_left_as_it_is(tmp_path, name):
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("years of work")
    before = tree(tmp_path)
    with pytest.raises(ConfigError, match=r"holds '.*' but no config.yaml"):
        train(CONFIG, tmp_path)
    with pytest.raises(ConfigError, match=r"but no study.yaml"):
        run_study(StudyConfig.model_validate(STUDY), tmp_path, 1)
    assert tree(tmp_path) == before


def test_what_somebody_puts_into_a_run_folder_stays(tmp_path):
    train(CONFIG, tmp_path)
    (tmp_path / "DONE").unlink()
    mine = ["checkpoint/thesis/a.txt", "checkpoint/step_12/b", "checkpoint/step_000000000001/c"]
    mine += ["checkpoint/.part-x/mine.txt", "notes.txt", "policy/other.txt"]
    for name in mine:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("kept")
    (tmp_path / ".part-evals.npz-abc").write_text("a writer died here")
    train(CONFIG, tmp_path)
    assert all((tmp_path / name).read_text() == "kept" for name in mine)
    assert not (tmp_path / ".part-evals.npz-abc").exists()


@pytest.mark.parametrize("name", ["checkpoint", "policy", "tensorboard", "evals.npz", "DONE"])
def test_links_in_a_run_folder_are_not_followed(tmp_path, name):
    target, folder = tmp_path / "target", tmp_path / "run"
    train(CONFIG, folder)
    (folder / "DONE").unlink()
    path = folder / name
    if path.exists():
        path.rename(tmp_path / "old")
    (target / "step_000000000128").mkdir(parents=True)
    (target / "step_000000000128" / "state.json").write_text("mine")
    path.symlink_to(target)
    before = tree(target)
    with pytest.raises(ConfigError, match="is a link"):
        train(CONFIG, folder)
    assert tree(target) == before


def test_a_lock_that_is_a_link_truncates_nothing(tmp_path):
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / ".lock").symlink_to(tmp_path / "precious")
    with pytest.raises(ConfigError, match="is a link"):
        train(CONFIG, tmp_path / "run")
    assert (tmp_path / "precious").read_text() == "precious"


def test_arms_that_would_share_a_folder_are_refused():
    for labels in (("raw", "r aw"), ("raw", "RAW"), ("raw", "r/aw")):
        levels = [{"label": label} for label in labels]
        with pytest.raises(ValueError, match="would share the folder"):
            StudyConfig.model_validate(STUDY | {"representations": levels, "baseline": "raw"})


@pytest.mark.parametrize("name", ["..", "../outside", "/etc", ".", "a/b", ""])
def test_a_study_file_cannot_name_folders_outside(make_finished, name):
    study = make_finished(lambda data: data["arms"][0].update(name=name))
    with pytest.raises(ResultsError, match="folder in the study's own"):
        load_study(study)


@pytest.fixture
def make_finished(tmp_path):
    def make(change=lambda data: None):
        study = StudyConfig.model_validate(STUDY)
        data = study.resolved()
        for run in study.runs():
            folder = files.run_folder(tmp_path / "study", run.name, run.seed)
            train(run.model_copy(update={"total_steps": 128}), folder)
        change(data)
        (tmp_path / "study" / "study.yaml").write_text(yaml.safe_dump(data))
        return tmp_path / "study"

    return make


def test_a_report_replaces_its_own_files_only(make_finished, tmp_path):
    study = make_finished()
    page = write_report(study, reps=20, kinds=("png",))
    write_report(study, reps=20, kinds=("png",))
    assert page.exists()
    out = tmp_path / "mine"
    out.mkdir()
    (out / "table.csv").write_text("mine")
    with pytest.raises(ResultsError, match="not of an earlier report"):
        write_report(study, out, reps=20, kinds=("png",))
    assert tree(out) == {"table.csv": b"mine"}


@pytest.mark.parametrize("name", ["report.json", "report.html", "table.csv", "forest.png"])
def test_links_in_a_report_are_not_followed(tmp_path, name):
    """Neither those of an earlier report nor those that a stranger has put there."""
    contents = {"table.csv": b"1", "forest.png": b"2", "report.html": b"3"}
    out, precious = tmp_path / "report", tmp_path / "precious"
    report._write(out, contents)
    precious.write_text("[]")
    (out / name).unlink()
    (out / name).symlink_to(precious)
    before = tree(out)
    with pytest.raises(ConfigError, match="is a link"):
        report._write(out, contents)
    assert precious.read_text() == "[]"
    assert tree(out) == before


@pytest.mark.parametrize("name", ["evals.npz", "manifest.json", "metrics.json", "DONE"])
def test_a_flipped_bit_in_results_is_refused(make_finished, name):
    study = make_finished()
    path = next(study.glob(f"*/*/{name}"))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(ResultsError, match="damaged run"):
        load_study(study)


def test_done_wins_over_a_stale_failure(make_finished):
    folder = next(make_finished().glob("*/seed_00"))
    (folder / "FAILED").write_text("old")
    assert load_run(folder, "arm", 0).status == "done"


def test_only_a_policy_that_is_not_finite_is_a_failure(tmp_path, monkeypatch):
    def broken(*args, **kwargs):
        raise PermissionError(13, "Permission denied", "somewhere")

    with monkeypatch.context() as patch:
        patch.setattr("agents.learning.checkpoint.Checkpoints.save", broken)
        with pytest.raises(PermissionError):
            train(CONFIG, tmp_path / "fault")
    assert not (tmp_path / "fault" / "FAILED").exists()
    assert train(CONFIG, tmp_path / "fault")
    hot = RUNS["ppo"]["algo"] | {"learning_rate": 1e30}
    config = TrainConfig.model_validate(RUNS["ppo"] | {"algo": hot})
    with pytest.raises(LearningFailure, match="not finite"), np.errstate(all="ignore"):
        train(config, tmp_path / "hot")
    assert "not finite" in (tmp_path / "hot" / "FAILED").read_text()


def test_a_full_disk_is_named_and_the_run_continues_later(tmp_path, monkeypatch):
    fsync = os.fsync
    full = True

    def maybe(handle):
        if full and "checkpoint" in os.readlink(f"/proc/self/fd/{handle}"):
            raise OSError(28, "No space left on device")
        return fsync(handle)

    monkeypatch.setattr(os, "fsync", maybe)
    with pytest.raises(OSError, match=r"no space left on the file system of /.* for .*step_"):
        train(CONFIG, tmp_path)
    full = False
    assert not (tmp_path / "FAILED").exists()
    assert train(CONFIG, tmp_path)


def test_a_folder_that_is_deleted_does_not_come_back_half_filled(tmp_path):
    run, gone = tmp_path / "run", tmp_path / "gone"
    path = write(tmp_path / "run.yaml", RUNS["ppo"] | {"total_steps": 128 * 1024})
    with popen("train", "--config", path, "--out", run) as process:
        while not list(run.glob("checkpoint/step_*")):
            assert process.poll() is None
            time.sleep(0.02)
        run.rename(gone)
        error = process.stderr.read()
    assert process.returncode == 2
    assert "error: " in error
    assert not run.exists()
    assert not (gone / "DONE").exists()
    assert not (gone / "FAILED").exists()
