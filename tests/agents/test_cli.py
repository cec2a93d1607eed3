"""The command line as a newcomer meets it."""

import subprocess
import sys

import pytest

from agents.files import ROOT


def call(*arguments):
    return subprocess.run(
        [sys.executable, str(ROOT / "train.py"), *arguments],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=ROOT,
    )


@pytest.mark.parametrize("command", ["train", "evaluate", "play", "study", "report"])
def test_help_explains_every_option(command):
    result = call(command, "--help")
    assert result.returncode == 0
    assert "(default" in result.stdout or "(required)" in result.stdout
    assert "Run folder" in result.stdout or "tudy" in result.stdout


def test_expected_errors_are_one_line_and_not_a_traceback(tmp_path):
    missing = call("train", "--config", str(tmp_path / "none.yaml"))
    assert missing.returncode == 2
    assert missing.stderr.startswith("error: ")
    assert "none.yaml" in missing.stderr
    assert "Traceback" not in missing.stderr
    empty = call("report", "--study", str(tmp_path))
    assert empty.returncode == 2
    assert "Traceback" not in empty.stderr
