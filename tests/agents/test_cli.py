"""The command line as a newcomer meets it."""

import os
import subprocess
import sys

import numpy as np
import pytest

from agents.files import ROOT
from agents.learning.play import gif_times


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


def test_mistakes_are_told_before_torch_is_loaded(tmp_path):
    (tmp_path / "run.yaml").write_text("total_steps: 0\n")
    told = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys, train\n"
            "for command in ('train', 'study', 'tune'):\n"
            "    assert train.main([command, '--config', 'run.yaml']) == 2\n"
            "assert train.main(['evaluate', '--run', '.']) == 2\n"
            "print('torch' in sys.modules)\n",
        ],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert told.stderr.count("error: ") == 4, told.stderr
    assert told.stdout == "False\n"


@pytest.mark.parametrize(("period_s", "count"), [(0.05, 20), (0.025, 20), (0.033, 50), (0.004, 25)])
def test_animations_last_as_long_as_what_they_show(period_s, count):
    times = gif_times(count, period_s)
    assert sum(times.values()) == round(1000.0 * period_s * count)
    assert min(times.values()) >= 20
    starts = np.cumsum([0, *times.values()])[:-1]
    np.testing.assert_allclose(starts, [1000.0 * period_s * place for place in times], atol=10.0)
