"""Steps to threshold against hand-worked and brute-force survival estimates."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agents.reporting import survival as v

times = st.lists(
    st.tuples(st.integers(1, 20).map(float), st.booleans()), min_size=1, max_size=12
).map(lambda pairs: ([p[0] for p in pairs], [p[1] for p in pairs]))


def test_first_crossing_counts_even_if_the_curve_falls_back():
    curves = [[0.0, 0.9, 0.2, 1.0], [0.95, 0, 0, 0], [0, 0, 0, 0.9], [0.0, 0.1, 0.2, 0.89]]
    steps, reached = v.first_crossing([0, 5, 10, 20], curves, 0.9)
    assert steps.tolist() == [5, 0, 20, 20]
    assert reached.tolist() == [True, True, True, False]


def test_first_crossing_of_no_run_is_empty():
    steps, reached = v.first_crossing([0, 5], np.zeros((0, 2)), 0.9)
    assert steps.shape == reached.shape == (0,)


def test_kaplan_meier_by_hand():
    # at risk 9, 5, 3 at the events 6 (three of them), 7 and 10; ties censor after the event
    steps = [6, 6, 6, 6, 7, 9, 10, 10, 11]
    reached = [1, 1, 1, 0, 1, 0, 1, 0, 0]
    at, survival = v.survival_curve(steps, reached)
    after_6, after_7, after_10 = 6 / 9, 6 / 9 * 4 / 5, 6 / 9 * 4 / 5 * 2 / 3
    assert at.tolist() == [0, 6, 7, 9, 10, 11]
    assert survival == pytest.approx([1, after_6, after_7, after_7, after_10, after_10])


def brute_survival(steps, reached, t):
    value = 1.0
    for u in sorted({s for s, r in zip(steps, reached, strict=True) if r and s <= t}):
        events = sum(s == u and r for s, r in zip(steps, reached, strict=True))
        value *= 1 - events / sum(s >= u for s in steps)
    return value


@given(times)
def test_kaplan_meier_matches_the_product(data):
    for t, survival in zip(*v.survival_curve(*data), strict=True):
        assert survival == pytest.approx(brute_survival(*data, t), abs=1e-12)


def test_restricted_mean_by_hand_with_censoring_inside():
    # survival 1 on [0, 2), 3/4 on [2, 6), 3/8 on [6, 10): the run censored at 4 leaves 2 at risk
    assert v.restricted_mean([2, 4, 6, 10], [1, 0, 1, 0], 10) == pytest.approx(2 + 3 + 1.5)


@given(times)
def test_restricted_mean_is_the_plain_mean_if_censored_at_the_budget(data):
    steps, reached = np.array(data[0]), np.array(data[1])
    steps = np.where(reached, steps, 20.0)
    assert v.restricted_mean(steps, reached, 20) == pytest.approx(steps.mean())
    assert v.restricted_mean_interval([steps], seed=0, reps=5).estimate == pytest.approx(
        steps.mean()
    )


def test_never_reached_costs_the_budget_and_has_no_median():
    assert v.restricted_mean([9, 9], [False, False], 9) == 9
    assert v.median_steps([9, 9], [False, False]) == np.inf
    assert v.median_steps([9, 5], [True, False]) == 9


@pytest.mark.parametrize("n", range(1, 30))
def test_median_is_the_step_at_which_half_are_there(n):
    assert v.median_steps(np.arange(1, n + 1), np.ones(n)) == (n + 1) // 2


def test_reached_at_once_costs_nothing():
    assert v.restricted_mean([0, 0], [True, True], 9) == 0
    assert v.median_steps([0, 0], [True, True]) == 0


def test_speed_up_is_the_ratio_of_restricted_means():
    base, other = [30.0, 30.0, 60.0], [10.0, 20.0]
    result = v.speed_up([base], [other], seed=0)
    assert result.estimate == pytest.approx(40 / 15)
    assert result.low < result.estimate < result.high
    assert v.speed_up([base], [other], seed=0) == result
    assert v.speed_up([other], [base], seed=0).estimate == pytest.approx(15 / 40)


@given(st.lists(st.integers(0, 3).map(float), min_size=2, max_size=5))
def test_speed_up_over_itself_is_one_even_at_zero_steps(steps):
    result = v.speed_up([steps], [steps], seed=0, reps=50)
    assert result.estimate == 1
    assert result.low <= 1 <= result.high


def test_speed_up_recovers_a_known_factor():
    rng = np.random.default_rng(1)
    covered = []
    for k in range(200):
        base, other = 100 * rng.lognormal(0, 0.3, 20), 50 * rng.lognormal(0, 0.3, 20)
        interval = v.speed_up([base], [other], seed=k, reps=300)
        covered.append(interval.low <= 2 <= interval.high)
    assert 0.88 <= np.mean(covered) <= 0.99


def test_logrank_by_hand():
    # events at 1, 2 (x) and 3, 4 (y): O - E = 2 - 5/6, V = 1/4 + 2/9, chi2 = 2.8824
    p = v.logrank_p([1, 2], [True, True], [3, 4], [True, True])
    assert p == pytest.approx(0.089555, abs=1e-5)


def test_logrank_without_any_event_is_undefined():
    assert np.isnan(v.logrank_p([9], [False], [9, 9], [False, False]))
