"""Colours stay apart for those who see fewer of them."""

import importlib.util
import itertools
from pathlib import Path

import pytest

from agents.files import ROOT
from agents.reporting import plots
from agents.reporting.committed import load_committed
from agents.reporting.loading import load_study
from agents.reporting.marks import MARKS, MOST, PALETTE, marks_of, panels_of
from agents.reporting.multiples import parts
from agents.reporting.report import FIGURES
from agents.reporting.summary import summarise

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


def assert_apart(found, seen):
    seen_as = {colour: colours.lab(colour, seen) for colour in found}
    for (name, one), (other, two) in itertools.combinations(seen_as.items(), 2):
        assert colours.ciede2000(one, two) >= 12.0, (name, other)


@pytest.mark.parametrize("ground", ["colour", "dark"])
@pytest.mark.parametrize("seen", colours.SEEN)
def test_any_two_marks_are_apart_for_everybody(seen, ground):
    found = [getattr(mark, ground) for mark in PALETTE]
    assert len(set(found)) == len(PALETTE) == 15
    assert_apart(found, seen)


def luminance(colour):
    return ((colours.lab(colour)[0] + 16) / 116) ** 3


def test_marks_stand_out_from_the_page():
    for mark in PALETTE:
        assert 1.05 / (luminance(mark.colour) + 0.05) > 1.75
        assert (luminance(mark.dark) + 0.05) / (luminance("#202327") + 0.05) > 3.0


def test_lines_and_markers_differ_where_colours_may_not_be_seen():
    shapes = [(str(mark.line), mark.marker) for mark in PALETTE]
    assert len(set(shapes)) == len(shapes)


def test_known_names_keep_their_marks_and_others_get_free_ones():
    assert MARKS["raw"].colour == "#D55E00"
    assert MARKS["clarke"].colour == "#0072B2"
    assert MARKS["repaired"] == MARKS["scaled marginal"]  # one arm under two names
    names = ["mine", "raw", "another", "clarke", "third"]
    found = marks_of(names)
    assert list(found) == names
    assert (found["raw"], found["clarke"]) == (MARKS["raw"], MARKS["clarke"])
    assert len(set(found.values())) == len(names)
    both = marks_of(["scaled marginal", "repaired"])
    assert len(set(both.values())) == 2


@pytest.mark.parametrize("count", [1, 7, 8, 14, 15, 16, 40])
def test_any_number_of_arms_is_divided_into_panels_of_different_marks(count):
    names = ["raw", *(f"arm {i}" for i in range(count - 1))]
    panels, marks = panels_of(names), marks_of(names)
    assert panels[0][0] == "raw"
    assert all(panel[0] == "raw" for panel in panels)
    assert ["raw", *(name for panel in panels for name in panel[1:])] == names
    for panel in panels:
        assert len(panel) <= MOST
        assert len({marks[name] for name in panel}) == len(panel)
    assert len(set(marks.values())) == min(count, len(PALETTE))
    assert max(map(len, panels)) - min(map(len, panels)) <= 1


FOLDERS = sorted(path.parent for path in (ROOT / "docs" / "results").glob("*/curves.csv"))


def drawn(ax):
    """Return the colours of arms in axes: of lines that have a colour of the palette."""
    palette = {mark.colour for mark in PALETTE}
    return {line.get_color() for line in ax.lines} & palette


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: folder.name)
def test_arms_of_every_panel_of_committed_studies_are_apart(folder):
    study = load_committed(folder)
    summary = summarise(study, seed=0, reps=2)
    some = [arm.arm for arm in summary.arms if arm.n]
    for draw in (plots.learning_curves, plots.auc_points, plots.survival, plots.forest):
        assert draw in {entry[2] for entry in FIGURES}
        against = draw is plots.forest  # rows of all tasks, and none of the baseline
        tasks = [study.tasks] if against else [[task] for task in study.tasks]
        counts = {
            len({arm.representation for arm in some if arm.task in group} & set(names))
            for group in tasks
            for names in (panel[against:] for panel in panels_of(study.representations))
        }
        figure = draw(summary, "")
        if against and len(study.representations) == 1:
            assert figure is None
            continue
        for ax in figure.axes:
            found = drawn(ax)
            assert len(found) in counts, (draw, ax)  # one colour an arm
            for seen in colours.SEEN:
                assert_apart(found, seen)


def test_panels_without_an_arm_of_their_task_are_left_out(make_study):
    early, late = ([f"{when} {i}" for i in range(6)] for when in ("early", "late"))
    tasks = {"t": ["raw", *early], "u": ["raw", *late], "v": ["raw"]}
    folder = make_study({task: dict.fromkeys(names, 1.0) for task, names in tasks.items()}, 1)
    study = load_study(folder)
    assert parts(study) == [
        ("t", "t", ["raw", *early]),
        ("u", "u", ["raw", *late]),
        ("v", "v", ["raw", *early]),
    ]
    axes = plots.auc_points(summarise(study, seed=0, reps=2), "").axes
    assert [ax.get_title() for ax in axes] == ["t", "u", "v"]
    assert [len(drawn(ax)) for ax in axes] == [7, 7, 1]
