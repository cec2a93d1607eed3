"""What several test modules share."""

import os
import shutil

os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck, settings

from clarke_gym import rendering
from clarke_gym.disturbances.base import DISTURBANCES
from clarke_gym.physics import PHYSICS
from clarke_gym.representations import REPRESENTATIONS, representation_names
from clarke_gym.robots.presets import make_robot
from clarke_gym.sensors import SENSORS
from clarke_gym.tasks import TASKS

# How fast a machine is today is nothing that a test may fail for.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("untimed")

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
GRAPHICS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="session")
def representations_for():
    """Return the representations that exist for n tendons."""

    def names(n):
        return [name for name in representation_names() if n == 4 or name != "antagonistic"]

    return names


@pytest.fixture
def registries(monkeypatch):
    """Forget afterwards what a test registers: other tests list what there is."""
    for registry in (TASKS, SENSORS, DISTURBANCES, REPRESENTATIONS, PHYSICS):
        monkeypatch.setattr(registry, "_entries", dict(registry._entries))


@pytest.fixture(scope="module")
def offscreen():
    """Skip where the machine has no off-screen OpenGL; the reason names the packages."""
    try:
        rendering.Picture(make_robot(), 32, 32).close()
    except RuntimeError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def browser():
    """Return a browser; skip where the machine has none, or nothing to drive it."""
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is missing: make test-browser installs it"
    )
    if CHROMIUM is None:
        pytest.skip("chromium is missing: make test-browser says how to install it")
    with sync_api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=GRAPHICS)
        yield found
        found.close()


@pytest.fixture
def figure(record_property):
    """Return a function that records a line for the end of the session, whichever process tests."""
    return lambda text: record_property("figure", text)


def figures(terminalreporter):
    """Return the figures that tests have recorded."""
    return sorted(
        text
        for report in terminalreporter.getreports("passed")
        if report.when == "call"
        for name, text in report.user_properties
        if name == "figure"
    )


def pytest_terminal_summary(terminalreporter):
    """Print the figures that tests have recorded."""
    lines = figures(terminalreporter)
    if lines:
        terminalreporter.section("figures")
        terminalreporter.write_line("\n".join(lines))
