"""The failure map: shares of seeds that fail, goal by goal, where runs tell their goals."""

import numpy as np
import pytest

from agents.reporting.failure_map import failing, failure_map
from agents.reporting.loading import load_study
from agents.reporting.results import ResultsError
from agents.reporting.summary import summarise

SPEEDS = {"n = 3": {"raw": 0.6, "clarke": 1.5}}
GOALS = np.random.default_rng(0).uniform([-0.1, -0.1, 0.05], [0.1, 0.1, 0.25], (50, 3))


def change(run, **changes):
    with np.load(run / "evals.npz") as file:
        arrays = dict(file) | changes
    np.savez(run / "evals.npz", **arrays)


def with_goals(folder):
    for run in folder.glob("*/seed_*"):
        change(run, goal_position_m=GOALS)
    return folder


def test_shares_count_seeds_and_failed_runs(make_study):
    folder = with_goals(make_study(SPEEDS, 4))
    (folder / "raw_0" / "seed_03" / "DONE").rename(folder / "raw_0" / "seed_03" / "FAILED")
    raw, _ = load_study(folder).arms
    goals, share = failing(raw)
    np.testing.assert_array_equal(goals, GOALS)
    last = np.array([evals.is_success[-1] for _, evals in raw.done])
    np.testing.assert_allclose(share, ((~last).sum(axis=0) + 1) / 4)
    assert 0.25 <= share.min() < share.max() <= 1.0


def test_every_arm_is_drawn_on_one_scale_and_where_its_goals_are(make_study):
    summary = summarise(load_study(with_goals(make_study(SPEEDS, 2))), seed=0, reps=20)
    figure = failure_map(summary, "footer")
    axes = [ax for ax in figure.axes if ax.get_title()]
    assert [ax.get_title() for ax in axes] == ["n = 3 · raw", "n = 3 · clarke"]
    for ax, arm in zip(axes, summary.study.arms, strict=True):
        (points,) = ax.collections
        _, share = failing(arm)
        assert points.get_clim() == (0.0, 1.0)
        np.testing.assert_allclose(np.sort(share), points.get_array())
        order = np.argsort(share, kind="stable")
        np.testing.assert_allclose(points.get_offsets(), 1000 * GOALS[order, :2])
    assert axes[0].get_xlim() == axes[1].get_xlim()


def test_there_is_no_map_where_goals_are_unknown_or_differ(make_study):
    folder = make_study(SPEEDS, 2)
    assert failure_map(summarise(load_study(folder), seed=0, reps=20), "") is None
    with_goals(folder)
    change(folder / "raw_0" / "seed_01", goal_position_m=GOALS + 0.01)
    raw, clarke = load_study(folder).arms
    assert failing(raw) is None
    assert failing(clarke) is not None


def test_goals_of_the_wrong_shape_are_refused(make_study):
    folder = make_study(SPEEDS, 1)
    change(folder / "raw_0" / "seed_00", goal_position_m=GOALS[:, :2])
    with pytest.raises(ResultsError, match="goal_position_m"):
        load_study(folder)
