"""A stranger's path, timed: a fresh clone, its environment, checks and tests, main job and site.

python -m benchmarks.fresh_clone [--at FOLDER]

docs/results/measured/fresh_clone.json keeps what each took.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from agents.files import ROOT
from benchmarks.measured import keep

COMMANDS = ("make install", "bash .ci/run", "make compare", "make docs")
PASSED = re.compile(r"(\d+) passed")


def main() -> None:
    """Clone, run each command in turn, print and keep the seconds."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fresh_clone")
    parser.add_argument("--at", type=Path, help="an empty folder; a temporary one by default")
    place = parser.parse_args().at or Path(tempfile.mkdtemp())
    subprocess.run(["git", "clone", "--quiet", str(ROOT), str(place)], check=True)
    commit = ["git", "-C", str(place), "rev-parse", "--short", "HEAD"]
    head = subprocess.run(commit, capture_output=True, text=True, check=True).stdout.strip()
    found: dict[str, Any] = {"commit": head}
    for command in COMMANDS:
        begin = time.monotonic()
        done = subprocess.run(
            command.split(), cwd=place, stdout=subprocess.PIPE, text=True, check=False
        )
        found[command] = round(time.monotonic() - begin)
        print(f"{command}: {found[command]} s", flush=True)
        if done.returncode:
            sys.exit(done.stdout[-2000:])
        if ".ci" in command:
            found["tests"] = int(PASSED.findall(done.stdout)[-1])
    keep("fresh_clone", found)


if __name__ == "__main__":
    main()
