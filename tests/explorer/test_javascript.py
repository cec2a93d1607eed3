"""The explorer's JavaScript computes what Python computes, and its data are what the code says."""

import json
import math
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from benchmarks import explorer_data

ROOT = Path(__file__).resolve().parents[2]
EXPLORER = ROOT / "docs" / "explorer"


def near(a, b, path=""):
    """Equal but for rounding, which other processors do in other ways."""
    if isinstance(a, dict):
        assert a.keys() == b.keys(), path
        for key in a:
            near(a[key], b[key], f"{path}.{key}")
    elif isinstance(a, list):
        assert len(a) == len(b), path
        for k, (x, y) in enumerate(zip(a, b, strict=True)):
            near(x, y, f"{path}[{k}]")
    elif isinstance(a, float):
        assert math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-6), f"{path}: {a} != {b}"
    elif isinstance(a, str):
        words, numbers = NUMBER.split(a), [float(x) for x in NUMBER.findall(a)]
        assert words == NUMBER.split(b), path
        near(numbers, [float(x) for x in NUMBER.findall(b)], path)
    else:
        assert a == b, path


NUMBER = re.compile(r"-?\b\d+(?:\.\d+)?(?:e-?\d+)?\b")


def test_the_golden_numbers_are_those_of_the_code():
    near(json.loads(explorer_data.GOLDEN.read_text()), explorer_data.golden())


def test_the_data_are_those_of_the_code():
    files = explorer_data.data()
    assert {path.name for path in explorer_data.DATA.iterdir()} == set(files)
    for name, text in files.items():
        near(json.loads((explorer_data.DATA / name).read_text()), json.loads(text), name)


def test_what_may_have_another_number_of_tendons():
    robots = json.loads((explorer_data.DATA / "robots.json").read_text())
    assert robots["default"]["even"]
    assert not robots["hardware"]["even"]
    stiffness = re.search(r'gainprm="([\d.]+)"', robots["default"]["mjcf"]["folded"])
    np.testing.assert_allclose(float(stiffness[1]), 1.5 * 2e5)


def test_javascript_meets_the_golden_numbers():
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is missing: make test-browser installs what these tests need")
    files = sorted(str(path) for path in Path(__file__).parent.glob("*.test.mjs"))
    done = subprocess.run([node, "--test", *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    assert "# fail 0" in done.stdout
    assert int(re.search(r"# pass (\d+)", done.stdout)[1]) >= 10
