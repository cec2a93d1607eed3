"""Studies that are not as they were planned: arms and tasks of unequal size, files that changed."""

import shutil

import numpy as np
import pytest
import yaml

from agents.metrics import Metric
from agents.registration import registration
from agents.reporting.bootstrap import Interval, bootstrap, bootstrap_band
from agents.reporting.latex import latex
from agents.reporting.loading import load_study
from agents.reporting.methods import methods
from agents.reporting.statistics import iqm, iqm_difference
from agents.reporting.summary import Comparison, summarise
from agents.reporting.tables import plain
from agents.reporting.wording import answer, reporting_block, warnings


def summary_of(folder):
    return summarise(load_study(folder), seed=0, reps=200)


def without(folder, arm, seeds):
    for seed in seeds:
        shutil.rmtree(folder / arm / f"seed_{seed:02d}")


def test_more_runs_of_the_easy_task_do_not_make_an_arm_better(make_study):
    speeds = {"easy": {"raw": 3.0, "clarke": 3.0}, "hard": {"raw": 0.7, "clarke": 0.7}}
    folder = make_study(speeds, 12)
    without(folder, "raw_0", range(3, 12))  # raw has few easy runs, clarke few hard ones
    without(folder, "clarke_1", range(3, 12))
    (row,) = summary_of(folder).pooled
    assert abs(row.auc_difference.estimate) < 0.05
    easy, hard = np.full(9, 0.9), np.full(9, 0.1)
    assert iqm_difference([easy, hard[:2]], [easy[:2], hard], seed=0).estimate == pytest.approx(0.0)
    both = iqm_difference([easy, hard], [hard, hard], seed=0).estimate
    assert both == iqm(np.concatenate([easy, hard])) - 0.1


def test_runs_of_a_seed_stay_together_whichever_are_missing():
    """Two tasks that are the very same: a second one tells nothing, and must not narrow it."""
    scores = np.random.default_rng(0).normal(size=20)

    def mean(arm):
        return np.mean([task.mean(axis=1) for task in arm], axis=0)

    def width(strata, units):
        found = bootstrap(mean, strata, seed=0, reps=4000, units=[units])
        return found.high - found.low

    every = list(range(20))
    one = width([scores], [every])
    assert width([scores, scores], [every, every]) == one
    for first, second in ((0, 19), (None, 19), (3, 3)):
        units = [[s for s in every if s != gone] for gone in (first, second)]
        assert width([scores[units[0]], scores[units[1]]], units) == pytest.approx(one, rel=0.15)
    apart = width([scores, scores], [every, [s + 100 for s in every]])
    assert apart == pytest.approx(one / np.sqrt(2.0), rel=0.15)


def test_draws_of_seeds_hold_each_run_as_often():
    units = [[0, 1, 2, 3, 4, 5], [4, 5, 6]]
    seen = []

    def keep(arm):
        seen.append(arm)
        return np.zeros(len(arm[0]))

    bootstrap_band(keep, [np.arange(6.0), np.arange(3.0)], seed=1, reps=6000, units=[units])
    for stratum, count in zip(seen[-1], (6, 3), strict=True):
        assert stratum.shape == (6000, count)
        shares = np.bincount(stratum.astype(int).ravel(), minlength=count) / stratum.size
        np.testing.assert_allclose(shares, 1.0 / count, rtol=0, atol=0.02)


def test_the_smallest_arm_decides_whether_a_claim_is_made(make_study):
    folder = make_study({"n = 3": {"raw": 0.6, "clarke": 1.5, "other": 1.0}}, 12)
    assert not summary_of(folder).smoke
    without(folder, "clarke_0", range(2, 12))
    summary = summary_of(folder)
    assert summary.smoke
    assert "(2 in the smallest arm" in warnings(summary)[0]


def test_a_study_that_was_changed_after_its_registration_says_so(make_study):
    plan = {"question": "?", "primary": "auc", "family": "f", "rule": "r", "planned_seeds": 2}
    folder = make_study({"n = 3": {"raw": 0.6, "clarke": 1.5}}, 4, preregistration=plan)
    path = folder / "study.yaml"
    data = yaml.safe_load(path.read_text())
    path.write_text(yaml.safe_dump(data | {"registered": registration(data)}))
    summary = summary_of(folder)
    assert reporting_block(summary)["Preregistered"].endswith("; 2 seeds planned, 4 run")
    assert "; 2 seeds planned, 4 run)" in methods(summary)
    assert not any("registered" in text for text in warnings(summary))
    data |= {"registered": registration(data), "preregistration": plan | {"rule": "another"}}
    path.write_text(yaml.safe_dump(data))
    summary = summary_of(folder)
    assert any("study.yaml is not what was registered" in text for text in warnings(summary))
    assert reporting_block(summary)["Preregistered"].endswith("CHANGED since")
    assert "registered before the runs" not in methods(summary)


HALF = Interval(0.5, 0.2, 0.8)


def compared(speed_up, **more):
    row = Comparison("t", "clarke", "raw", speed_up, HALF, HALF, (3, 3), **more)
    return answer(row, 0.9, 200_000)


def test_ratios_of_censored_means_are_bounds_in_sentences_too():
    stay = {"sustained_speed_up": Interval(0.75, 0.5, 0.9), "runs": (6, 6)}
    assert "to stay there ≥ 1.33×" in compared(Interval(2, 1.5, 3), never_stayed=(6, 0), **stay)
    assert "to stay there 1.33×" in compared(Interval(2, 1.5, 3), **stay)
    text = compared(Interval(1.0, 0.5, 2.0), censored=(1, 1), runs=(6, 6))
    assert "ratio (both arms censored) about 1.00" in text
    nothing = Interval(float("inf"), float("nan"), float("nan"))
    assert "no interval: an arm needed no steps" in compared(nothing, runs=(6, 6))
    assert "no interval: a single seed" in compared(nothing, runs=(1, 6))


def test_steps_do_not_exceed_the_budget(make_study):
    summary = summary_of(make_study({"n = 3": {"raw": 0.55, "clarke": 0.62}}, 4))
    for arm in summary.arms:
        assert 0.0 <= arm.restricted_steps.low <= arm.restricted_steps.high <= 200_000


@pytest.mark.parametrize(
    ("worst", "values", "rises"),
    [
        (0.0, [0.0, 0.0, 0.0, 0.6], True),  # most held nothing
        (0.0, [0.2, 0.5], True),
        (0.4, [0.4, 0.4, 0.4, 0.01], False),  # most went astray
        (float("inf"), [0.1, 0.2], False),
        (-0.01, [-0.02, 0.1, 0.2], True),
    ],
)
def test_where_the_worst_lies_says_which_way_is_better(worst, values, rises):
    assert Metric("m", "m", "", worst).rises(values) is rises


def test_labels_of_strangers_are_set_as_they_are():
    text = latex([["arm", "x"], ["[a]", "<1"], ["*b", "\u221e"]])
    assert "{}[a] & $<$1" in text
    assert "{}*b & $\\infty$" in text
    assert plain("*x* \\ `y`") == "\\*x\\* \\\\ \\`y\\`"
