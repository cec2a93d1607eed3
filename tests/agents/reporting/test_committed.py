"""Committed curves say what the run folders said."""

import pytest

from agents.files import ROOT
from agents.reporting.committed import load_committed
from agents.reporting.loading import load_study
from agents.reporting.report import table_page, write_report
from agents.reporting.results import ResultsError
from agents.reporting.summary import summarise

FOLDERS = sorted(path.parent for path in (ROOT / "docs" / "results").glob("*/curves.csv"))


def test_the_statistics_of_success_are_the_same(make_study):
    folder = make_study(
        {"-0.5": {"raw": 0.7, "clarke": 1.5}},  # in CSV files an apostrophe stands before it
        5,
        base={"evaluation": {"n_goals": 50}},
    )
    write_report(folder, reps=50, kinds=("png",))
    (folder / "report" / "study.yaml").write_text((folder / "study.yaml").read_text())
    ours, theirs = (
        summarise(study, seed=0, reps=50)
        for study in (load_study(folder), load_committed(folder / "report"))
    )
    assert theirs.comparisons == ours.comparisons
    for a, b in zip(ours.arms, theirs.arms, strict=True):
        assert (a.auc, a.final_success, a.restricted_steps) == (
            b.auc,
            b.final_success,
            b.restricted_steps,
        )
        left, right = a.metrics["tip_error_m"], b.metrics["tip_error_m"]
        assert right.estimate == pytest.approx(left.estimate, rel=1e-4)


def test_what_is_missing_is_said(tmp_path):
    (tmp_path / "study.yaml").write_text("name: x\nbase: {evaluation: {n_goals: 50}}\n")
    with pytest.raises(ResultsError, match=r"curves\.csv: cannot be read"):
        load_committed(tmp_path)


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda f: f.name)
def test_committed_tables_are_those_of_committed_curves(folder):
    """Bootstrap ends need many draws; the estimates do not, and every row is there."""
    summary = summarise(load_committed(folder), seed=0, reps=2)
    text = (folder / "table.md").read_text()
    for arm in summary.arms:
        assert f"| {arm.arm.task} | {arm.arm.representation} | {arm.n} of " in text
        assert f"| {arm.auc.estimate:.3f} \\[" in text
    for row in summary.comparisons:
        difference = f"{row.auc_difference.estimate:+.3f}".replace("-", "−").lstrip("+")
        assert difference.replace("−0.000", "0.000") in text


@pytest.mark.parametrize("name", ["hold", "suite"])
def test_tables_of_several_metrics_are_written_again_to_the_byte(name):
    folder = ROOT / "docs" / "results" / name
    assert table_page(load_committed(folder)) == (folder / "table.md").read_text()


def test_what_a_task_declares_is_known_without_its_runs(make_study):
    folder = make_study({"t": {"raw": 0.7, "clarke": 1.5}}, 3, base={"evaluation": {"n_goals": 50}})
    write_report(folder, reps=20, kinds=("png",))
    (folder / "report" / "study.yaml").write_text((folder / "study.yaml").read_text())
    ours, theirs = load_study(folder), load_committed(folder / "report")
    assert theirs.metrics == ours.metrics
    (folder / "report" / "metrics.json").write_text("[]")
    with pytest.raises(ResultsError, match="AttributeError"):
        load_committed(folder / "report")
