"""What was measured on a machine, kept for the pages that tell it: docs/results/measured."""

from __future__ import annotations

import json
import os
import platform
from functools import cache
from typing import Any

from agents.files import ROOT, write_text

FOLDER = ROOT / "docs" / "results" / "measured"


def keep(name: str, values: dict[str, Any]) -> None:
    """Write what a script has measured, and on what machine.

    Parameters
    ----------
    name : str
        The script's name.
    values : dict
        Numbers, lists and texts by name.
    """
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    told = {"machine": machine, "python": platform.python_version()} | values
    FOLDER.mkdir(parents=True, exist_ok=True)
    write_text(FOLDER / f"{name}.json", json.dumps(told, indent=1, ensure_ascii=False) + "\n")


@cache
def measured(name: str) -> dict[str, Any]:
    """Return what a script has measured.

    Raises
    ------
    FileNotFoundError
        If it has not been run.
    """
    found: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    return found
