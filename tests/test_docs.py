"""The documentation executes, and its pictures exist."""

import doctest
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGE = DOCS / "clarke_in_ten_minutes.md"


def test_ten_minutes_executes():
    pytest.importorskip("torch")
    text = PAGE.read_text()
    test = doctest.DocTestParser().get_doctest(
        re.sub(r"^```.*$", "", text, flags=re.MULTILINE), {}, PAGE.name, str(PAGE), 0
    )
    assert len(test.examples) > 30
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    report: list[str] = []
    runner.run(test, out=report.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(report)


def test_every_picture_of_the_page_exists_and_every_picture_is_used():
    pictures = set(re.findall(r"\]\((figures/[^)]+)\)", PAGE.read_text()))
    assert pictures == {f"figures/{path.name}" for path in (DOCS / "figures").glob("*.png")}


def test_the_page_of_sensors_is_what_the_code_says():
    from benchmarks.sensor_tables import PAGE as SENSORS_PAGE
    from benchmarks.sensor_tables import page

    assert SENSORS_PAGE.read_text() == page()


def test_the_page_of_limits_is_what_the_code_says():
    from benchmarks.limits import PAGE as LIMITS_PAGE
    from benchmarks.limits import page

    assert LIMITS_PAGE.read_text() == page()


def test_the_leaderboard_and_the_pages_of_tasks_are_what_code_and_data_say():
    import json

    from benchmarks import leaderboard, task_pages

    data = json.loads(leaderboard.DATA.read_text())
    assert leaderboard.PAGE.read_text() == leaderboard.page(data)
    written = {path.name: path.read_text() for path in task_pages.FOLDER.glob("*.md")}
    assert written == task_pages.pages()


def test_the_page_of_planning_is_what_its_data_say():
    import json

    from benchmarks import planning

    assert planning.PAGE.read_text() == planning.page(json.loads(planning.DATA.read_text()))
