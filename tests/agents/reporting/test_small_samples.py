"""Intervals of few runs: against SciPy, and they cover what they say."""

import numpy as np
import pytest
from scipy import stats

from agents.reporting import small_samples as few
from agents.reporting.statistics import iqm

X, Y = np.random.default_rng(0).normal([[5.0], [6.0]], size=(2, 9))


def test_the_difference_is_scipys_trimmed_welch_interval():
    found = few.iqm_difference_t(X, Y[:7])
    test = stats.ttest_ind(X, Y[:7], equal_var=False, trim=0.25).confidence_interval()
    assert (found.low, found.high) == pytest.approx((test.low, test.high), abs=1e-12)
    assert found.estimate == pytest.approx(iqm(X) - iqm(Y[:7]))


def test_the_difference_of_means_is_welchs():
    found = few.mean_difference_t(X, Y[:7])
    expected = stats.ttest_ind(X, Y[:7], equal_var=False).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), rel=1e-12)
    assert not few.mean_difference_t([1.0], Y).known


def test_of_three_runs_it_is_students_interval_of_the_mean():
    found = few.iqm_t(X[:3])
    reference = stats.ttest_1samp(X[:3], 0.0).confidence_interval()
    assert (found.low, found.high) == pytest.approx((reference.low, reference.high))


def test_the_ratio_of_means_does_not_care_about_units_and_turns_over():
    found, other = few.mean_ratio_t(X, Y), few.mean_ratio_t(1000.0 * Y, 1000.0 * X)
    assert found.estimate == pytest.approx(X.mean() / Y.mean())
    assert (found.low, found.high) == pytest.approx((1 / other.high, 1 / other.low))


@pytest.mark.parametrize("n", [5, 10])
@pytest.mark.parametrize("kind", ["iqm", "difference", "ratio"])
def test_coverage(n, kind):
    rng = np.random.default_rng(1)
    covered = []
    for _ in range(1500):
        if kind == "ratio":
            found, truth = few.mean_ratio_t(*rng.lognormal(0.0, 0.2, (2, n))), 1.0
        else:
            x, y = rng.normal(size=(2, n))
            found, truth = (few.iqm_t(x) if kind == "iqm" else few.iqm_difference_t(x, y)), 0.0
        covered.append(found.low <= truth <= found.high)
    assert 0.93 <= np.mean(covered) <= 0.975


def test_without_spread_the_interval_has_no_width_and_one_run_has_none():
    assert few.iqm_t([1.0] * 5) == few.Interval(1.0, 1.0, 1.0)
    assert not few.iqm_t([1.0]).known
    assert not few.mean_ratio_t([1.0], [2.0, 3.0]).known
    assert few.mean_ratio_t([0.0, 0.0], [0.0, 0.0]).estimate == 1.0
    with pytest.raises(ValueError, match="one run or more"):
        few.iqm_t([])
