"""Trials of a tuning as a figure: every configuration is a dot, the best one is marked."""

import numpy as np
import pytest

from agents.files import ROOT, TRIALS
from agents.reporting.house_style import FORMATS
from agents.reporting.marks import MARKS
from agents.reporting.results import ResultsError
from agents.reporting.tuning import read_trials, tuning_figure, write_tuning

TUNED = ROOT / "docs" / "results" / "tuned"
ARMS = {
    "raw_n3": ("n = 3", "raw"),
    "clarke_n3": ("n = 3", "clarke"),
    "raw_n11": ("n = 11", "raw"),
    "clarke_n11": ("n = 11", "clarke"),
}


def test_dots_are_means_over_seeds_and_the_winner_is_the_best_of_them():
    trials = read_trials(TUNED / TRIALS)
    assert {name: scores.shape for name, scores in trials.items()} == dict.fromkeys(ARMS, (24, 3))
    assert trials["raw_n3"][0].tolist() == [0.655, 0.711, 0.7675]
    first, second = tuning_figure(trials, ARMS).axes
    assert (first.get_title(), second.get_title()) == ("n = 3", "n = 11")
    names = [label.get_text() for label in first.get_yticklabels()]
    assert names == ["raw", "clarke"]
    for ax, arms in ((first, list(ARMS)[:2]), (second, list(ARMS)[2:])):
        dots = [line.get_xdata() for line in ax.lines if line.get_marker() == "."]
        winners = [line for line in ax.lines if line.get_markersize() == 9]
        for arm, found, winner in zip(arms, dots, winners, strict=True):
            means = trials[arm].mean(axis=1)
            np.testing.assert_allclose(found, means)
            assert winner.get_xdata()[0] == means.max()
            assert winner.get_color() == MARKS[ARMS[arm][1]].colour


def test_the_committed_figure_shows_the_committed_trials():
    text = (TUNED / "tuning.svg").read_text()
    for scores in read_trials(TUNED / TRIALS).values():
        assert f">{scores.mean(axis=1).max():.3f}<" in text


def test_it_is_written_beside_its_trials_the_same_every_time(tmp_path):
    folders = [tmp_path / "one", tmp_path / "other"]
    for folder in folders:
        folder.mkdir()
        (folder / TRIALS).write_bytes((TUNED / TRIALS).read_bytes())
        write_tuning(folder, ARMS)
    one, other = ({path.name: path.read_bytes() for path in f.iterdir()} for f in folders)
    assert one == other
    assert set(one) == {TRIALS, *(f"tuning.{kind}" for kind in FORMATS)}


@pytest.mark.parametrize(
    "text",
    [
        "arm,configuration,seed\nraw,0,1\n",
        "arm,configuration,seed,auc\n",
        "arm,configuration,seed,auc\nraw,0,1,0.5\nraw,0,2,0.5\nraw,1,1,0.5\n",
    ],
)
def test_a_damaged_table_is_said(tmp_path, text):
    (tmp_path / TRIALS).write_text(text)
    with pytest.raises(ResultsError, match=r"tuning\.csv"):
        read_trials(tmp_path / TRIALS)
