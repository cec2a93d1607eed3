"""What several test modules share."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest

from clarke_gym import rendering
from clarke_gym.representations import representation_names
from clarke_gym.robots.presets import make_robot


@pytest.fixture(scope="session")
def representations_for():
    """Return the representations that exist for n tendons."""

    def names(n):
        return [name for name in representation_names() if n == 4 or name != "antagonistic"]

    return names


@pytest.fixture(scope="module")
def offscreen():
    """Skip where the machine has no off-screen OpenGL; the reason names the packages."""
    try:
        rendering.Picture(make_robot(), 32, 32).close()
    except RuntimeError as error:
        pytest.skip(str(error))


@pytest.fixture
def figure(record_property):
    """Return a function that records a line for the end of the session, whichever process tests."""
    return lambda text: record_property("figure", text)


def pytest_terminal_summary(terminalreporter):
    """Print the figures that tests have recorded."""
    lines = [
        text
        for report in terminalreporter.getreports("passed")
        if report.when == "call"
        for name, text in report.user_properties
        if name == "figure"
    ]
    if lines:
        terminalreporter.section("figures")
        terminalreporter.write_line("\n".join(sorted(lines)))
