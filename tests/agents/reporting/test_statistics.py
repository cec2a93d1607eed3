"""Statistics against frozen values, SciPy, brute force and invariants."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from agents.reporting import statistics as s
from agents.reporting.bootstrap import Interval, bootstrap, bootstrap_band

scores = st.lists(st.integers(-20, 20).map(float), min_size=2, max_size=8)
arms = st.lists(scores, min_size=1, max_size=3)


def test_auc_of_uneven_grid_by_hand():
    # trapezoids 10 * 0.5 + 30 * 0.75 over a range of 40
    assert s.auc([0, 10, 40], [0.0, 1.0, 0.5]) == pytest.approx(27.5 / 40)


@given(st.floats(0, 1), st.lists(st.integers(1, 1000), min_size=1, max_size=20))
def test_auc_of_a_constant_is_the_constant(height, spacings):
    steps = np.cumsum([0, *spacings])
    assert s.auc(steps, np.full(steps.size, height)) == pytest.approx(height, abs=1e-12)


def test_auc_does_not_depend_on_where_the_steps_start():
    assert s.auc([100, 110, 140], [0.0, 1.0, 0.5]) == pytest.approx(27.5 / 40)


@pytest.mark.parametrize(
    ("steps", "curve"), [([0, 0], [1, 1]), ([0], [1]), ([0, 1], [1, 1, 1]), ([2, 1], [0, 0])]
)
def test_auc_refuses_bad_grids(steps, curve):
    with pytest.raises(ValueError, match=r"env_steps|curves"):
        s.auc(steps, curve)


def brute_iqm(values):
    ordered = sorted(map(Fraction, values))
    cut = len(ordered) // 4
    kept = ordered[cut : len(ordered) - cut]
    return float(sum(kept) / len(kept))


@given(scores)
def test_iqm_is_the_mean_of_the_middle_half(values):
    assert s.iqm(values) == pytest.approx(brute_iqm(values), rel=1e-12, abs=1e-12)


@given(scores, st.floats(-3, 3), st.floats(-10, 10))
def test_iqm_follows_scale_and_shift(values, scale, shift):
    moved = scale * np.array(values) + shift
    assert s.iqm(moved) == pytest.approx(scale * s.iqm(values) + shift, abs=1e-9)


def test_iqm_interval_matches_scipy_bootstrap():
    x = np.random.default_rng(3).normal(size=15)
    ours = s.iqm_interval([x], seed=0, reps=20_000)
    reference = stats.bootstrap(
        (x,),
        lambda a, axis: stats.trim_mean(a, 0.25, axis=axis),
        n_resamples=20_000,
        method="percentile",
        rng=np.random.default_rng(1),
    ).confidence_interval
    assert ours.low == pytest.approx(reference.low, abs=0.03)
    assert ours.high == pytest.approx(reference.high, abs=0.03)


def test_a_task_told_twice_is_no_further_evidence():
    """In Clarke coordinates tasks can be the very same; their runs are then the same runs."""
    x = np.random.default_rng(5).normal(size=20)

    def mean(arm):
        return np.mean([stratum.mean(axis=1) for stratum in arm], axis=0)

    once, thrice = bootstrap(mean, [x], seed=0), bootstrap(mean, [x, x, x], seed=0)
    assert [thrice.low, thrice.high] == pytest.approx([once.low, once.high], abs=1e-12)
    other = np.random.default_rng(6).normal(size=20)
    apart, told_twice = bootstrap(mean, [x, other], seed=0), bootstrap(mean, [x, x], seed=0)
    assert apart.high - apart.low < 0.9 * (told_twice.high - told_twice.low)


def test_interval_of_two_runs_enumerated():
    # resamples of {0, 1} have means 0, 1/2, 1 with probability 1/4, 1/2, 1/4
    wide = s.iqm_interval([[0.0, 1.0]], seed=0)
    narrow = s.iqm_interval([[0.0, 1.0]], seed=0, level=0.4)
    assert (wide.low, wide.high) == (0.0, 1.0)
    assert (narrow.low, narrow.high) == (0.5, 0.5)


def test_runs_are_resampled_within_their_task_only():
    # every task is constant, so a stratified resample always has the same pooled scores
    result = s.iqm_interval([[0.0] * 4, [1.0] * 4], seed=0)
    assert result == Interval(0.5, 0.5, 0.5)


def test_arms_are_resampled_independently():
    x = np.random.default_rng(0).normal(size=12)
    difference = s.iqm_difference([x], [x], seed=0)
    assert difference.estimate == 0
    assert difference.low < -0.2 < 0.2 < difference.high


def test_same_seed_same_interval_and_other_seed_another():
    x = [np.random.default_rng(0).normal(size=12)]
    y = [np.random.default_rng(1).normal(size=12)]
    for statistic in (s.iqm_difference, s.probability_of_improvement):
        first = statistic(x, y, seed=1)
        np.random.seed(5)  # noqa: NPY002 - the global generator must not matter
        assert statistic(x, y, seed=1) == first
        assert len({statistic(x, y, seed=k, reps=50) for k in range(5)}) > 1


@settings(max_examples=50)
@given(arms)
def test_interval_ends_are_ordered_and_inside_the_data(strata):
    result = s.iqm_interval(strata, seed=0, reps=100)
    flat = np.concatenate(strata)
    assert flat.min() - 1e-9 <= result.low <= result.high <= flat.max() + 1e-9


@pytest.mark.parametrize("level", [0.5, 0.9])
def test_higher_level_is_wider(level):
    x = [np.random.default_rng(0).normal(size=12)]
    inner, outer = (s.iqm_interval(x, seed=0, level=v) for v in (level, level + 0.09))
    assert outer.low <= inner.low < inner.high <= outer.high


def test_coverage_is_about_nominal_with_twenty_seeds():
    rng = np.random.default_rng(7)
    covered = [
        (i := s.iqm_interval([rng.normal(size=20)], seed=k, reps=400)).low <= 0 <= i.high
        for k in range(400)
    ]
    assert 0.91 <= np.mean(covered) <= 0.98


def test_a_single_run_has_no_interval_in_any_statistic():
    one, two = [[0.5], [0.1, 0.2]], [[0.3, 0.2], [0.1, 0.4]]
    for result in (
        s.iqm_interval(one, seed=0),
        s.optimality_gap(one, seed=0),
        s.iqm_difference(two, one, seed=0),
        s.probability_of_improvement(one, two, seed=0),
    ):
        assert np.isfinite(result.estimate)
        assert not result.known
        assert not result.excludes(100.0)


def test_curve_band_agrees_with_intervals_point_by_point():
    curves = np.random.default_rng(0).random((7, 3))
    centre, low, high = s.curve_band(curves, seed=4)
    for e in range(3):
        point = s.iqm_interval([curves[:, e]], seed=4)
        assert (centre[e], low[e], high[e]) == (point.estimate, point.low, point.high)
    assert s.curve_band(curves, seed=4, mean=True)[0] == pytest.approx(curves.mean(axis=0))


def brute_improvement(x, y):
    pairs = [
        np.mean([(a > b) + 0.5 * (a == b) for a, b in itertools.product(u, v)])
        for u, v in zip(x, y, strict=True)
    ]
    return float(np.mean(pairs))


@given(st.lists(st.tuples(scores, scores), min_size=1, max_size=3))
def test_improvement_matches_pairs_and_its_complement(pairs):
    x, y = [p[0] for p in pairs], [p[1] for p in pairs]
    forward = s.probability_of_improvement(x, y, seed=0, reps=50)
    backward = s.probability_of_improvement(y, x, seed=0, reps=50)
    assert forward.estimate == pytest.approx(brute_improvement(x, y), abs=1e-12)
    assert forward.estimate + backward.estimate == pytest.approx(1)
    assert 0 <= forward.low <= forward.high <= 1


def test_improvement_is_the_mann_whitney_statistic():
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, 5, 9), rng.integers(0, 5, 6)
    u = stats.mannwhitneyu(x, y).statistic
    estimate = s.probability_of_improvement([x], [y], seed=0).estimate
    assert estimate == pytest.approx(u / (9 * 6), abs=1e-12)


def test_improvement_weighs_tasks_alike():
    x, y = [[1.0] * 2, [0.0] * 8], [[0.0] * 2, [1.0] * 8]
    assert s.probability_of_improvement(x, y, seed=0).estimate == 0.5


def test_improvement_refuses_unequal_tasks():
    with pytest.raises(ValueError, match="1 and 2 tasks"):
        s.probability_of_improvement([[1, 2]], [[1, 2], [1, 2]], seed=0)


def test_optimality_gap_caps_scores_at_the_target():
    assert s.optimality_gap([[0.5, 1.5], [1.0]], seed=0).estimate == pytest.approx(0.5 / 3)


@given(scores)
def test_profile_matches_the_empirical_distribution(errors):
    levels = np.linspace(-25, 25, 11)
    expected = stats.ecdf(errors).cdf.evaluate(levels)
    assert s.performance_profile([errors], levels)[0] == pytest.approx(expected, abs=1e-12)


def test_infinite_error_never_counts_in_a_profile():
    assert s.performance_profile([[np.inf, 1.0]], [1e9]).tolist() == [[0.5]]


def test_welch_matches_scipy():
    rng = np.random.default_rng(0)
    x, y = rng.normal(size=6), rng.normal(0.5, 2, size=9)
    expected = stats.ttest_ind(x, y, equal_var=False).pvalue
    assert s.welch_p(x, y) == pytest.approx(expected)


@pytest.mark.parametrize(("x", "y"), [([1.0], [1.0, 2.0]), ([0.0, 0.0], [1.0, 1.0])])
def test_welch_is_undefined_without_spread(x, y):
    assert np.isnan(s.welch_p(x, y))


def test_holm_worked_example():
    # sorted .005 .01 .03 .04 times 4 3 2 1 is .02 .03 .06 .04, made monotone
    assert s.holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


def test_holm_leaves_undefined_tests_out_of_the_family():
    assert s.holm([0.02, np.nan, 0.9]) == pytest.approx([0.04, np.nan, 0.9], nan_ok=True)
    assert s.holm([]).size == 0


@given(st.lists(st.floats(0, 1), min_size=1, max_size=8))
def test_holm_lies_between_raw_and_bonferroni(p):
    adjusted = s.holm(p)
    assert (adjusted >= np.array(p)).all()
    assert (adjusted <= np.minimum(1, len(p) * np.array(p)) + 1e-12).all()


@pytest.mark.parametrize("strata", [[], [[]], [[1.0, 2.0], []]])
def test_empty_arms_are_refused(strata):
    with pytest.raises(ValueError, match="at least one"):
        s.iqm_interval(strata, seed=0)


@pytest.mark.parametrize("options", [{"reps": 0}, {"level": 1.0}, {"level": 0.0}])
def test_bad_bootstrap_settings_are_refused(options):
    with pytest.raises(ValueError, match="reps"):
        bootstrap(lambda a: a[0].mean(axis=1), [[1.0, 2.0]], seed=0, **options)


def test_bootstrap_of_infinite_draws_does_not_warn():
    def reciprocal(arm):
        with np.errstate(divide="ignore"):
            return 1 / arm[0].mean(axis=1)

    _, low, high = bootstrap_band(reciprocal, [[0.0, 1.0]], seed=0)
    assert (low, high) == (1.0, np.inf)


def test_scores_that_are_equal_but_for_rounding_are_ties():
    """0.469 is the mean height of both, in sums of another order."""
    one, other = np.array([0.469, 0.5]), np.array([0.46900000000000003, 0.5])
    assert one[0] != other[0]
    found = s.probability_of_improvement([one], [other], seed=0, reps=10)
    assert found.estimate == (0.5 + 0.5 + 0.0 + 1.0) / 4.0
