"""Colours stay apart for those who see fewer of them."""

import importlib.util
import itertools
from pathlib import Path

import pytest

from agents.reporting.house_style import MARKS

_spec = importlib.util.spec_from_file_location("colours", Path(__file__).with_name("colours.py"))
colours = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(colours)


@pytest.mark.parametrize(  # of Sharma, Wu and Dalal, 2005
    ("one", "two", "expected"),
    [
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
        ((2.0776, 0.0795, -1.1350), (0.9033, -0.0636, -0.5514), 0.9082),
    ],
)
def test_the_difference_is_ciede2000(one, two, expected):
    assert colours.ciede2000(one, two) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("seen", colours.SEEN)
def test_any_two_marks_are_apart_for_everybody(seen):
    distinct = {mark.colour: colours.lab(mark.colour, seen) for mark in MARKS.values()}
    for (name, one), (other, two) in itertools.combinations(distinct.items(), 2):
        assert colours.ciede2000(one, two) >= 12.0, (name, other)
