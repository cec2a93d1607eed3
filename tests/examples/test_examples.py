"""Every example runs as a reader would run it, and those that learn have learned."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


NEEDS = {
    "with_sb3_sac_her": ["stable_baselines3"],
    "with_cleanrl_ppo": ["torch"],
    "with_torchrl": ["torchrl", "tensordict"],
    "with_skrl": ["skrl"],
    "with_minari": ["minari", "h5py", "torch"],
}
"""Libraries that an example needs beside clarke_gym."""


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda p: p.stem)
def test_examples_run(path, tmp_path):
    for library in NEEDS.get(path.stem, []):
        if importlib.util.find_spec(library) is None:
            pytest.skip(f"{library} is missing: pip install {library}")
    done = subprocess.run(
        [sys.executable, str(path)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert done.stderr == ""
    for reached in re.findall(r"(\d\.\d\d) of the goals", done.stdout):
        assert float(reached) >= 0.6, done.stdout
