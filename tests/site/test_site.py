"""The built site: whole, without strangers, and saying what the code offers. `make docs` first."""

import importlib
import re
from html.parser import HTMLParser
from pathlib import Path
from types import FunctionType

import pytest

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "docs" / "_build" / "html"
ROOMS_OF_THE_SITE = (
    *("index", "get_started", "clarke_in_ten_minutes", "explorer", "environments"),
    *("robots_and_physics", "learning", "results", "extend", "use_with", "reference/index"),
    *("architecture", "changelog", "roadmap", "search"),
)
PAGES = sorted(SITE.glob("[!_]*.html")) + sorted(SITE.glob("[!_]*/**/*.html"))


@pytest.fixture(scope="module", autouse=True)
def built():
    if not (SITE / "index.html").exists():
        pytest.skip("the site is not built: make docs builds it and runs these tests")


class Links(HTMLParser):
    """Collect what a page loads, where it links to, its anchors and its pictures."""

    def __init__(self):
        super().__init__()
        self.loads, self.links, self.anchors, self.untold = [], [], set(), []

    def handle_starttag(self, tag, attributes):
        told = dict(attributes)
        if told.get("id"):
            self.anchors.add(told["id"])
        if tag in ("script", "img", "iframe", "source") and told.get("src"):
            self.loads.append(told["src"])
        if tag == "link" and told.get("rel") != "canonical":
            self.loads.append(told.get("href", ""))
        if tag == "a" and told.get("href"):
            self.links.append(told["href"])
        if tag == "img" and not told.get("alt"):
            self.untold.append(told.get("src"))


def read(path):
    links = Links()
    links.feed(path.read_text(encoding="utf-8"))
    return links


def test_all_rooms_of_the_site_are_there():
    names = {path.relative_to(SITE).as_posix() for path in PAGES}
    for page in ROOMS_OF_THE_SITE:
        assert f"{page}.html" in names
    assert (SITE / "explorer" / "index.html").exists()
    assert (SITE / "explorer" / "vendor" / "mujoco.wasm.gz").exists()
    assert not list(SITE.rglob("node_modules"))


def test_no_page_loads_from_elsewhere_and_every_inner_link_leads_somewhere():
    pages = {path: read(path) for path in PAGES}
    wrong = []
    for path, links in pages.items():
        wrong += [f"{path.name} loads {url}" for url in links.loads if re.match(r"\w+://|//", url)]
        for link in links.loads + links.links:
            if re.match(r"\w+:|//", link):
                continue
            target, _, anchor = link.partition("#")
            target = (path.parent / target.split("?")[0]).resolve() if target else path
            if target.is_dir():
                target = target / "index.html"
            if not target.exists():
                wrong.append(f"{path.relative_to(SITE)}: {link}")
            elif anchor and target in pages and anchor not in pages[target].anchors:
                wrong.append(f"{path.relative_to(SITE)}: no anchor {link}")
    assert wrong == []


def test_every_picture_is_told_in_words():
    untold = {path.relative_to(SITE).as_posix(): read(path).untold for path in PAGES}
    assert {page for page, pictures in untold.items() if pictures} == set()


def test_executed_pages_show_what_their_code_said():
    text = re.sub(r"<[^>]+>", "", (SITE / "get_started.html").read_text(encoding="utf-8"))
    assert "(7,) (2,)" in text
    assert "reached: True" in text
    rates = re.findall(r"(\d+) tendons: (\d\.\d\d)", text)
    assert [int(n) for n, _ in rates] == [3, 7, 11, 32]
    assert min(float(rate) for _, rate in rates) >= 0.9


ROOMS = (
    *("clarke", "kinematics", "robots", "representations", "wrappers", "control"),
    *("tasks", "sensors", "disturbances", "rendering", "figures"),
)


@pytest.mark.parametrize("room", ROOMS)
def test_the_reference_names_all_classes_and_functions(room):
    module = importlib.import_module(f"clarke_gym.{room}")
    anchors = set().union(*(read(path).anchors for path in (SITE / "reference").glob("*.html")))
    for name in module.__all__:
        if not isinstance(getattr(module, name), type | FunctionType):
            continue
        assert f"clarke_gym.{room}.{name}" in anchors, f"clarke_gym.{room}.{name}"
