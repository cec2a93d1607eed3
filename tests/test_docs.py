"""The documentation executes, and its pictures exist."""

import doctest
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
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


def test_every_page_is_what_code_and_results_say():
    from benchmarks import pages

    for path, text in pages.pages():
        assert path.read_text() == text, f"{path}: python -m benchmarks.pages writes it again"


def test_a_number_in_prose_that_differs_from_its_file_is_seen_and_mended():
    from benchmarks.prose.sentences import filled, uncovered

    sentence = "needs «2.07 [1.90, 2.25]» times the steps of «11» tendons"
    page = "Raw needs 2.05 [1.90,\n2.25] times the steps\nof 11 tendons."
    mended = "Raw needs 2.07 [1.90, 2.25] times the steps\nof 11 tendons."
    assert filled(page, [sentence]) == mended
    assert filled(mended, [sentence]) == mended
    with pytest.raises(ValueError, match="0 times what it should hold once"):
        filled("Raw needs more.", [sentence])
    with pytest.raises(ValueError, match="2 times what it should hold once"):
        filled(page + page, [sentence])
    assert uncovered(page + "\n\nAnd 7 more.", [sentence]) == ["5: And 7 more."]


def test_why_clarke_fails_where_the_results_differ(monkeypatch):
    from benchmarks import mechanism, why_clarke

    arms = mechanism.mechanism()
    moved = arms | {"raw": replace(arms["raw"], auc=arms["raw"].auc + 0.002)}
    monkeypatch.setattr(mechanism, "mechanism", lambda: moved)
    assert why_clarke.PAGE.read_text() != why_clarke.page()


def test_the_laws_over_n_are_fitted_as_they_are_written():
    from benchmarks.scaling_law import fit_linear, fit_power, linear, power

    n = np.array([3.0, 6.0, 11.0, 64.0])
    assert float(fit_power(n, power(n, 0.4))) == pytest.approx(0.4)
    assert float(fit_linear(n, linear(n, 0.07))) == pytest.approx(0.07, rel=0.01)
    assert power(2, 0.4) == linear(2, 0.07) == 1.0


def test_the_reference_lists_every_module_once():
    pages = sorted((DOCS / "reference").glob("*.md"))
    modules = re.findall(r"automodule:: (\S+)", "".join(page.read_text() for page in pages))
    assert modules
    assert len(set(modules)) == len(modules)
