"""The report: what it says follows from the data, and it holds for any shape of study."""

import csv
import json
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest

from agents.reporting import plots
from agents.reporting.bootstrap import Interval
from agents.reporting.house_style import FORMATS, rendered
from agents.reporting.loading import load_study
from agents.reporting.marks import MARKS
from agents.reporting.report import write_report
from agents.reporting.results import ResultsError
from agents.reporting.small_samples import iqm_difference_t
from agents.reporting.statistics import welch_p
from agents.reporting.summary import Comparison, summarise
from agents.reporting.survival import logrank_p
from agents.reporting.wording import answer, cpu_text, footer, reporting_block, verdict

APART = {"n = 3": {"raw": 0.6, "clarke": 1.5}}


FIGURES = (
    *("learning_curves", "forest", "auc"),
    *("steps_to_threshold", "tip_error_profile", "wall_clock"),
)
OTHERS = {
    "report.json",
    "table.csv",
    "curves.csv",
    "runs.csv",
    "metrics.json",
    "table.md",
    "table.tex",
    "methods.md",
    "report.html",
}


def files(figures=FIGURES, kinds=("png",)):
    """Return the files of a report."""
    return OTHERS | {f"{name}.{kind}" for name in figures for kind in kinds}


def report(folder, **options):
    return write_report(folder, **{"reps": 200, "kinds": ("png",)} | options)


def table(folder):
    text = (folder / "report" / "table.csv").read_text()
    return list(csv.DictReader(text.splitlines()))


def summary_of(folder):
    return summarise(load_study(folder), seed=0, reps=200)


class Page(HTMLParser):
    """Collects the tags and checks that they close in order."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self, text):
        super().__init__()
        self.stack, self.tags = [], []
        self.feed(text)
        assert not self.stack

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag


def test_writes_every_file_and_leaves_no_temporary(make_study):
    folder = make_study(APART)
    target = report(folder, kinds=FORMATS)
    assert target == folder / "report" / "report.html"
    assert {path.name for path in target.parent.iterdir()} == files(kinds=FORMATS)


def test_page_is_self_contained_and_accessible(make_study):
    text = report(make_study(APART)).read_text()
    tags = Page(text).tags
    assert ("html", {"lang": "en"}) in tags
    assert "<title>Raw tendon space against Clarke coordinates</title>" in text
    images = [attrs for tag, attrs in tags if tag == "img"]
    assert len(images) == 6
    assert all(i["alt"] and i["src"].startswith("data:image/png;base64,") for i in images)
    assert not {tag for tag, _ in tags} & {"link", "iframe"}
    assert [attrs.get("type") for tag, attrs in tags if tag == "script"] == [
        "application/json",
        None,
    ]
    assert not re.search(r"https?://|url\(|@import", text)
    assert "prefers-color-scheme: dark" in text


def test_same_input_gives_the_same_bytes_and_another_seed_other_ones(make_study, tmp_path):
    folder = make_study(APART, 6)
    first, again, other = tmp_path / "a", tmp_path / "b" / "deep", tmp_path / "c"
    for place in (first, again):
        report(folder, out_dir=place, kinds=FORMATS)
    report(folder, out_dir=other, seed=1)
    for name in files(kinds=FORMATS):
        assert (first / name).read_bytes() == (again / name).read_bytes(), name
    assert (first / "table.csv").read_text() != (other / "table.csv").read_text()


@pytest.mark.parametrize("draw", [plots.learning_curves, plots.profiles])
def test_bands_follow_the_bootstrap_seed(make_study, draw):
    study = load_study(make_study(APART, 6))
    one, two = (
        rendered(draw(summarise(study, seed=seed, reps=50), "footer"), "png") for seed in (0, 1)
    )
    assert one != two


def test_user_text_is_escaped(make_study):
    evil = "<script>alert('$x^$')</script>"
    folder = make_study({evil: {"raw": 1, "<i>&": 1}}, title=evil, note=evil, tuning=evil)
    text = report(folder).read_text()
    Page(text)
    assert text.count("<script") == text.count("</script") == 2  # the page's own
    assert "<i>" not in text
    assert "&lt;script&gt;" in text


@pytest.mark.parametrize(
    ("speeds", "word", "phrase"),
    [
        ({"raw": 0.7, "clarke": 1.6}, "Better", "AUC of success of Clarke coordinates was higher"),
        ({"raw": 1.6, "clarke": 0.7}, "Worse", "AUC of success of Clarke coordinates was lower"),
        ({"raw": 1.0, "clarke": 1.0}, "No difference shown", "No difference shown in AUC"),
    ],
)
def test_the_answer_falls_the_way_of_the_data(make_study, speeds, word, phrase):
    folder = make_study({"n = 7": speeds}, 10)
    text = report(folder).read_text()
    found = re.search(r"n = 7: <span[^>]*>([^<]+)</span>", text)
    assert found
    assert found.group(1) == word
    assert phrase in text.split("<h2>")[0]


def test_the_headline_numbers_are_those_of_the_data(make_study):
    folder = make_study(APART, 10)
    study = load_study(folder)
    (row,) = summary_of(folder).comparisons
    raw, clarke = (study.success(arm) for arm in study.arms)
    steps = [
        np.mean(
            [
                next((s for s, r in zip(study.env_steps, c, strict=True) if r >= 0.9), 200_000)
                for c in cs
            ]
        )
        for cs in (raw, clarke)
    ]
    assert row.speed_up.estimate == pytest.approx(steps[0] / steps[1])
    assert row.steps_ratio.estimate == pytest.approx(steps[1] / steps[0])
    assert row.steps_ratio.low == pytest.approx(1 / row.speed_up.high)
    ratio = f"{steps[1] / steps[0]:.2f}× the environment steps"
    assert f"needed at most {ratio}" in answer(row, 0.9, 200_000)  # raw is censored


def comparison(speed_up, difference, reached=(3, 3)):
    half = Interval(0.5, 0.2, 0.8)
    return Comparison("t", "clarke", "raw", speed_up, difference, half, reached)


@pytest.mark.parametrize(
    ("speed_up", "difference", "word"),
    [
        ((2, 1.5, 2.5), (0.1, 0.05, 0.2), "Better"),
        ((0.5, 0.4, 0.6), (-0.1, -0.2, -0.05), "Worse"),
        ((2, 1.5, 2.5), (0.1, -0.05, 0.2), "No difference shown"),
        ((2, 1.5, 2.5), (-0.1, -0.2, -0.05), "Worse"),
        ((2, np.nan, np.nan), (0.1, np.nan, np.nan), "No interval"),
    ],
)
def test_the_primary_score_alone_decides_the_verdict(speed_up, difference, word):
    assert verdict(comparison(Interval(*speed_up), Interval(*difference))) == word


def test_answer_never_claims_steps_that_no_run_reached():
    row = comparison(Interval(1, 1, 1), Interval(0, -0.1, 0.1), reached=(0, 0))
    text = answer(row, 0.9, 200_000)
    assert "no run of either reached 90 % success within 200,000 steps" in text
    assert "needed" not in text


@pytest.mark.parametrize(("n_seeds", "smoke"), [(9, True), (10, False)])
def test_few_seeds_are_called_smoke_on_page_and_figures(make_study, n_seeds, smoke):
    folder = make_study(APART, n_seeds, note="a note")
    text = report(folder).read_text()
    assert ("Smoke result: too few seeds for a claim" in text) is smoke
    line = footer(summary_of(folder))
    assert line.startswith("SMOKE") is smoke
    assert "a note" in line


def test_single_seed_has_no_interval_and_says_so(make_study):
    folder = make_study(APART | {"n = 4": {"raw": 1, "clarke": 1}}, 1)
    text = report(folder).read_text()
    assert "single seed" in text
    assert "No interval" in text
    assert "nan" not in re.sub(r"base64,[^\"]*", "", text)
    (row, *_) = table(folder)
    assert row["auc"]
    assert row["auc_low"] == ""


def test_partial_study_lists_what_is_missing_and_counts_failures(make_study):
    folder = make_study(APART | {"n = 4": {"raw": 1, "clarke": 1, "rotated": 1}})
    shutil.rmtree(folder / "raw_1")
    for seed in range(3):
        (folder / "clarke_1" / f"seed_0{seed}" / "DONE").unlink()
    (folder / "clarke_0" / "seed_02" / "DONE").rename(folder / "clarke_0" / "seed_02" / "FAILED")
    text = report(folder).read_text()
    assert "6 of 15 runs are not finished" in text
    assert "1 failed runs count as success 0" in text
    assert "n = 4: no run of the baseline raw" in text
    assert "n = 4: no run of clarke" in text
    assert "<td>raw_1</td><td>2</td><td>missing</td>" in text
    assert "<td>clarke_0</td><td>2</td><td>failed</td>" in text
    summary = summary_of(folder)
    assert [arm.n for arm in summary.arms] == [3, 3, 0, 0, 3]
    assert summary.find("n = 3", "clarke").reached == 2
    block = reporting_block(summary)
    assert block["Runs"] == "9 of 15"
    assert block["Failures counted as zeros"] == "1"


def test_study_without_baseline_or_side_files_still_reports(make_study):
    folder = make_study({"t": {"clarke": 1, "rotated": 1}})
    for name in ("manifest.json", "progress.csv"):
        for path in folder.glob(f"*/*/{name}"):
            path.unlink()
    text = report(folder).read_text()
    assert "No comparison is possible yet" in text
    names = {path.name for path in (folder / "report").iterdir()}
    assert names == files(set(FIGURES) - {"forest", "wall_clock"})
    block = reporting_block(summary_of(folder))
    assert block["Code"] == block["CPU hours"] == "unknown"


def test_ten_arms_and_five_tasks(make_study):
    left_out = ("raw_scaled", "scaled marginal", "repaired")
    names = [*[name for name in MARKS if name not in left_out], "unheard_of"]
    folder = make_study({f"n = {n}": dict.fromkeys(names, 1.0) for n in range(3, 8)}, 2)
    report(folder)
    summary = summary_of(folder)
    assert len(summary.comparisons) == 45
    assert len(summary.pooled) == 9
    assert len(table(folder)) == 50


def test_arms_that_never_succeed_are_reported_without_a_median(make_study):
    folder = make_study({"t": {"raw": 0.05, "clarke": 0.05}})
    text = report(folder).read_text()
    assert "not reached" in text
    assert "no run of either reached" in text


def test_p_values_are_adjusted_over_all_comparisons(make_study):
    folder = make_study({f"{k}": {"raw": 1.0, "clarke": 1.3} for k in range(4)}, 5)
    summary = summary_of(folder)
    raw, clarke = (summary.find("0", name).runs for name in ("raw", "clarke"))
    # the four tasks hold the same runs, so every p-value is four times that of one task
    for row in summary.comparisons:
        assert row.welch_p == pytest.approx(min(1, 4 * welch_p(raw.auc, clarke.auc)))
        single = logrank_p(raw.steps, raw.reached, clarke.steps, clarke.reached)
        assert row.logrank_p == pytest.approx(min(1, 4 * single))


def test_cpu_hours_tell_how_many_runs_they_cover(make_study):
    folder = make_study(APART)
    assert cpu_text(load_study(folder)) == "0.60"
    (folder / "raw_0" / "seed_00" / "manifest.json").unlink()
    assert cpu_text(load_study(folder)) == "0.50 (known for 5 of 6 runs)"


def test_failed_write_keeps_the_old_report(make_study, monkeypatch):
    folder = make_study(APART)
    target = report(folder)
    before = target.read_bytes()
    monkeypatch.setattr("os.fdopen", lambda *_: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        report(folder)
    assert target.read_bytes() == before
    assert {path.name for path in target.parent.iterdir()} == files()


def test_classical_control_is_drawn_where_the_study_measured_it(make_study):
    study = make_study({"n = 3": {"raw": 1.0, "clarke": 1.5}})
    summaries = [summarise(load_study(study), reps=50, seed=0)]
    entry = {"agent": "clarke_controller", "success_rate": 0.5, "metrics": {"tip_error_m": 0.02}}
    (study / "references.json").write_text(json.dumps({"n = 3": entry}))
    loaded = load_study(study)
    assert loaded.references["n = 3"].metrics == {"tip_error_m": 0.02}
    summaries.append(summarise(loaded, reps=50, seed=0))
    without, with_it = (rendered(plots.learning_curves(s, ""), "png") for s in summaries)
    assert with_it != without
    (study / "references.json").write_text("{")
    with pytest.raises(ResultsError, match=r"references\.json"):
        load_study(study)


def test_data_behind_the_report_is_complete(make_study):
    folder = make_study({"n = 3": {"raw": 1.0, "clarke": 1.5}}, n_seeds=2)
    report(folder)
    rows = list(csv.DictReader((folder / "report" / "curves.csv").read_text().splitlines()))
    study = load_study(folder)
    assert len(rows) == 4 * len(study.env_steps)
    last = [row for row in rows if row["representation"] == "clarke" and row["seed"] == "1"][-1]
    clarke = next(arm for arm in study.arms if arm.representation == "clarke")
    assert float(last["success_rate"]) == pytest.approx(study.success(clarke)[1, -1])
    runs = list(csv.DictReader((folder / "report" / "runs.csv").read_text().splitlines()))
    assert {row["git_sha"] for row in runs} == {"0123456789abcdef"}
    assert len(runs) == 4


def measure_otherwise(run, metrics, rng):
    """Replace what a run measured."""
    with np.load(run / "evals.npz") as file:
        arrays = {k: file[k] for k in ("env_steps", "is_success", "episode_return")}
    shape = arrays["is_success"].shape
    arrays |= {m["name"]: rng.uniform(1.0, 2.0, shape) for m in metrics}
    np.savez(run / "evals.npz", **arrays)
    (run / "metrics.json").write_text(json.dumps(metrics))


def test_whatever_a_task_measures_flows_to_tables_and_figures_by_name(make_study):
    """A task without a tip error, whose leading metric is better when it is higher."""
    folder = make_study(APART)
    metrics = [
        {"name": "laps", "label": "laps", "unit": "", "worst": 0.0},
        {"name": "gap_m", "label": "gap to the leader", "unit": "m", "worst": 3.0},
    ]
    rng = np.random.default_rng(0)
    for run in folder.glob("*/seed_*"):
        measure_otherwise(run, metrics, rng)
    (folder / "clarke_0" / "seed_02" / "DONE").rename(folder / "clarke_0" / "seed_02" / "FAILED")
    text = report(folder).read_text()
    assert '<th scope="col">Final laps</th>' in text
    assert "they have no laps" in text
    assert "tip error" not in text.lower()
    names = {path.name for path in (folder / "report").iterdir()}
    assert names == files(set(FIGURES) - {"tip_error_profile"} | {"laps_profile"})
    row = table(folder)[0]
    assert 1.0 < float(row["final_laps_low"]) <= float(row["final_laps"]) < 2.0
    assert 1000.0 < float(row["final_gap_mm"]) < 2000.0
    curves = (folder / "report" / "curves.csv").read_text().splitlines()
    assert curves[0].endswith("success_rate,laps,gap_mm")


def test_a_profile_counts_the_goals_that_are_at_least_as_good(make_study, monkeypatch):
    folder = make_study({"t": {"raw": 1.0}}, 1)
    seen = []
    monkeypatch.setattr(plots, "curve_band", lambda runs, **_: seen.append(runs) or (runs[0],) * 3)
    for worst, rising in ((2.0, True), (0.0, False)):
        metrics = [{"name": "score", "label": "score", "unit": "", "worst": worst}]
        measure_otherwise(folder / "raw_0" / "seed_00", metrics, np.random.default_rng(0))
        plots.profiles(summary_of(folder), "")
        (shares,) = seen.pop()
        assert (np.diff(shares) >= 0).all() if rising else (np.diff(shares) <= 0).all()
        assert {shares.min() < 0.1, shares.max() > 0.9} == {True}


def test_tasks_that_measure_different_things_share_a_table(make_study):
    folder = make_study({"reach": {"raw": 1.0, "clarke": 1.5}, "race": {"raw": 1.0, "clarke": 1.5}})
    metrics = [{"name": "laps", "label": "laps", "unit": "", "worst": 0.0}]
    for run in [*folder.glob("raw_1/seed_*"), *folder.glob("clarke_1/seed_*")]:
        measure_otherwise(run, metrics, np.random.default_rng(0))
    text = report(folder).read_text()
    assert "Final tip error, mm" in text
    assert "Final laps" in text
    assert "nan" not in re.sub(r"base64,[^\"]*", "", text)
    reach, race = table(folder)[0], table(folder)[2]
    assert reach["final_laps"] == race["final_tip_error_mm"] == ""
    assert float(reach["final_tip_error_mm"]) > 0.0
    assert float(race["final_laps"]) > 0.0


def test_a_ratio_of_censored_runs_is_printed_as_a_bound(make_study):
    folder = make_study({"n = 3": {"raw": 0.6, "clarke": 2.5}}, 6)
    (row,) = summary_of(folder).comparisons
    assert row.censored[0] == 0 < row.censored[1]
    text = (report(folder).parent / "table.md").read_text()
    assert f"≤ {row.steps_ratio.estimate:.2f} \\[" in text
    assert "needed at most " in text


def test_a_task_a_number_of_tendons_has_a_trend_with_its_interval(make_study):
    speeds = {f"n = {n}": {"raw": 1.6 - 0.05 * n, "clarke": 1.6} for n in (3, 6, 12)}
    folder = make_study(speeds, 10)
    summary = summary_of(folder)
    (trend,) = summary.trends
    gaps = [row.auc_difference.estimate for row in summary.comparisons]
    raw = {t: summary.find(t, "raw").runs.auc.mean() for t in speeds}
    clarke = {t: summary.find(t, "clarke").runs.auc.mean() for t in speeds}
    expected = np.polyfit(np.log2([3, 6, 12]), [clarke[t] - raw[t] for t in speeds], 1)[0]
    assert trend.slope.estimate == pytest.approx(expected)
    assert trend.slope.excludes(0.0)
    assert gaps[0] < gaps[2]
    assert "each doubling of n" in (report(folder).parent / "table.md").read_text()


def test_few_seeds_have_students_interval(make_study):
    summary = summary_of(make_study(APART, 6))
    few, (raw, clarke) = summary.comparisons[0], summary.arms
    assert few.auc_difference == iqm_difference_t(clarke.runs.auc, raw.runs.auc)
