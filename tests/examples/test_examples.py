"""Every example runs as a reader would run it, and those that learn have learned."""

import importlib.util

import pytest

from agents.files import ROOT
from benchmarks.use_with import REACHED, run

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
    done = run(path, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert done.stderr == ""
    for reached in REACHED.findall(done.stdout):
        assert float(reached) >= 0.6, done.stdout
