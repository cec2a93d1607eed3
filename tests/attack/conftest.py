"""Every test of this folder is an attack; `make attack` writes what the long form has found."""

import time
from pathlib import Path

import pytest

from benchmarks.measured import keep
from tests.attack.world import LONG
from tests.conftest import figures

BEGAN = time.monotonic()


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.attack)


def pytest_terminal_summary(terminalreporter, exitstatus):
    """Keep the figures of a whole long form for the page on reliability."""
    if LONG and exitstatus == 0:
        counts = {name: len(terminalreporter.getreports(name)) for name in ("passed", "skipped")}
        found = {**counts, "seconds": round(time.monotonic() - BEGAN)}
        keep("attacks", {**found, "figures": figures(terminalreporter)})
