"""The page in a real browser: curves are pointed at, hidden and shown, at night and on a phone."""

import base64
import json
import re

import numpy as np
import pytest

from agents.reporting.html import Picture
from agents.reporting.html import page as report_page
from agents.reporting.interactive import POLICY, SCRIPT, curves_data, script_json
from agents.reporting.loading import load_study
from agents.reporting.marks import MARKS
from agents.reporting.summary import summarise

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&"
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGNgYGD4DwABBAEAX+XDSwAAAABJRU5ErkJggg=="
)
SPEEDS = {"n = 3": {"raw": 0.8, "clarke": 1.5}, "n = 7": {"raw": 0.6, "clarke": 1.5}}


def test_no_text_ends_the_script_that_holds_it():
    data = {EVIL: [f"{EVIL}\u2028\u2029", 1.5, None]}
    text = script_json(data)
    assert not set(text) & set("<>&\u2028\u2029")
    assert json.loads(text) == data


def test_the_data_are_those_of_the_figure(make_study):
    summary = summarise(load_study(make_study(SPEEDS, 3)), seed=0, reps=50)
    data = curves_data(summary)
    assert [arm["name"] for arm in data["arms"]] == ["raw", "clarke"]
    assert data["arms"][0]["light"] == MARKS["raw"].colour
    assert data["steps"] == summary.study.env_steps.tolist()
    (band,) = (
        b
        for b in summary.bands
        if (b.task, b.representation, b.metric) == ("n = 7", "clarke", None)
    )
    panel = data["panels"][1]
    assert panel["title"] == "n = 7"
    assert panel["quantities"] == ["success rate", "tip error [mm]"]
    curve = panel["curves"][0][1]
    assert curve["arm"] == 1
    for name in ("centre", "low", "high"):
        np.testing.assert_allclose(curve[name], getattr(band, name), rtol=1e-3)


def test_one_seed_has_no_band_in_the_data(make_study):
    summary = summarise(load_study(make_study(SPEEDS, 1)), seed=0, reps=50)
    curve = curves_data(summary)["panels"][0]["curves"][0][0]
    assert set(curve["low"]) == {None}
    assert None not in curve["centre"]


def test_the_script_can_fetch_nothing():
    assert "default-src 'none'" in POLICY
    assert "script-src 'sha256-" in POLICY
    assert not re.search(r"https?:|fetch\(|import\(|eval\(|innerHTML|XMLHttp", SCRIPT)


@pytest.fixture
def make_page(make_study, tmp_path):
    """Return a writer of pages: one picture, as other tests look at figures."""

    def make(speeds, n_seeds=2, change=lambda study: None, **overrides):
        folder = make_study(speeds, n_seeds, **overrides)
        change(folder)
        summary = summarise(load_study(folder), seed=0, reps=50)
        target = tmp_path / "report.html"
        target.write_text(report_page(summary, [Picture("a.png", "a picture", "A picture.", PNG)]))
        return target, curves_data(summary)

    return make


@pytest.fixture
def open_page(browser):
    """Open a report; at the end nothing may have been complained about or asked for."""
    contexts, complaints = [], []

    def opened(path, size=(1280, 800), **options):
        context = browser.new_context(viewport={"width": size[0], "height": size[1]}, **options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(20_000)
        address = path.as_uri()
        page.on("console", lambda m: complaints.append(m.text))
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("dialog", lambda dialog: (complaints.append(dialog.message), dialog.dismiss()))
        page.on(
            "request",
            lambda request: (
                request.url == address
                or request.url.startswith("data:")
                or complaints.append(f"a request to {request.url}")
            ),
        )
        page.goto(address)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert complaints == []


def soon(locator):
    """Wait for what an input leads to: browsers draw when they can."""
    from playwright.sync_api import expect

    return expect(locator)


def curves(page, arm):
    return page.locator(f"#curves .panel >> nth=0 >> [data-arm='{arm}'] .centre")


def at_step(page, share):
    """Return a place in the first plot; its curves lie between 44 and 12 pixels from the edges."""
    box = page.locator("#curves .plot").first.bounding_box()
    return {"x": 44 + share * (box["width"] - 56), "y": box["height"] / 2}


def test_pointing_shows_step_arm_value_and_interval(make_page, open_page):
    target, data = make_page(SPEEDS, 3)
    page = open_page(target)
    assert page.locator("#curves .panel h3").all_inner_texts() == ["n = 3", "n = 7"]
    values = page.locator("#curves .values").first
    assert values.is_hidden()
    page.locator("#curves .plot").first.hover(position=at_step(page, 0.5))
    soon(values).to_contain_text("100,000 steps, success rate")
    text = values.inner_text()
    at = data["steps"].index(100_000)
    for curve in data["panels"][0]["curves"][0]:
        low, centre, high = (f"{curve[key][at]:.3g}" for key in ("low", "centre", "high"))
        name = data["arms"][curve["arm"]]["name"]
        assert re.search(rf"{name}\s+{centre}\s+\[{low}, {high}\]", text)
    page.mouse.move(1, 1)
    soon(values).to_be_hidden()
    page.locator("#curves .quantity button").nth(1).click()
    page.locator("#curves .plot").first.hover(position=at_step(page, 1.0))
    soon(values).to_contain_text("200,000 steps, tip error [mm]")


def test_a_button_hides_an_arm_and_shows_it_again_by_keys_alone(make_page, open_page):
    page = open_page(make_page(SPEEDS)[0])
    soon(curves(page, 0)).to_have_count(1)
    soon(curves(page, 1)).to_have_count(1)
    button = page.get_by_role("button", name="clarke")
    soon(button).to_have_attribute("aria-pressed", "true")
    button.focus()
    page.keyboard.press("Space")
    soon(button).to_have_attribute("aria-pressed", "false")
    soon(curves(page, 0)).to_have_count(1)
    soon(curves(page, 1)).to_have_count(0)
    page.locator("#curves .plot").first.focus()
    page.keyboard.press("End")
    values = page.locator("#curves .values").first
    soon(values).to_contain_text("200,000 steps")
    soon(values).to_contain_text("raw")
    soon(values).not_to_contain_text("clarke")
    page.keyboard.press("ArrowLeft")
    soon(values).to_contain_text("190,000 steps")
    page.keyboard.press("Escape")
    soon(values).to_be_hidden()
    button.focus()
    page.keyboard.press("Enter")
    soon(curves(page, 1)).to_have_count(1)


def test_a_phone_shows_all_without_scrolling_sideways(make_page, open_page):
    names = ["raw", *(f"an arm with a rather long name {i}" for i in range(9))]
    target, _ = make_page({"n = 3": dict.fromkeys(names, 1.0)})
    page = open_page(target, (375, 812), has_touch=True, is_mobile=True)
    assert page.locator("#curves .panel h3").all_inner_texts() == [
        "n = 3 (1 of 2)",
        "n = 3 (2 of 2)",
    ]
    page.locator("#curves .plot").first.tap(position=at_step(page, 0.9))
    values = page.locator("#curves .values").first
    soon(values).to_contain_text("180,000 steps")
    box = values.bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 375
    assert page.evaluate("document.documentElement.scrollWidth") <= 375


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_colours_follow_the_scheme(make_page, open_page, scheme):
    page = open_page(make_page(SPEEDS)[0], color_scheme=scheme)
    colour = MARKS["raw"].dark if scheme == "dark" else MARKS["raw"].colour
    expected = f"rgb({', '.join(str(int(colour[i : i + 2], 16)) for i in (1, 3, 5))})"
    seen = curves(page, 0).evaluate("(path) => getComputedStyle(path).stroke")
    assert seen == expected


def test_nothing_moves_for_those_who_ask_for_it(make_page, open_page):
    target, _ = make_page(SPEEDS)
    for motion, moves in (("reduce", False), ("no-preference", True)):
        page = open_page(target, reduced_motion=motion)
        button = page.locator("#curves button").first
        duration = button.evaluate("(button) => getComputedStyle(button).transitionDuration")
        assert (duration != "0s") is moves


def test_hostile_labels_are_shown_and_execute_nothing(make_page, open_page):
    def rename(folder):
        path = folder / "study.yaml"
        path.write_text(
            path.read_text().replace("representation: clarke", f"representation: {EVIL!r}")
        )

    target, data = make_page({"n = 3": SPEEDS["n = 3"]}, change=rename, title=EVIL, note=EVIL)
    assert data["arms"][1]["name"] == EVIL
    page = open_page(target)
    soon(page.locator("#curves .arms")).to_contain_text(EVIL)
    page.locator("#curves .plot").first.hover(position=at_step(page, 0.5))
    soon(page.locator("#curves .values").first).to_contain_text("onerror")
    assert page.locator("#curves img, #curves script").count() == 0


def test_without_javascript_the_figures_are_there(make_page, open_page):
    page = open_page(make_page(SPEEDS)[0], java_script_enabled=False)
    assert page.locator("#curves").is_hidden()
    assert page.locator("figure img").first.is_visible()
