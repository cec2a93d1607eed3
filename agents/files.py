"""Run folders: where they lie, atomic writes, one writer at a time, and what a manifest says."""

from __future__ import annotations

import fcntl
import importlib.metadata
import io
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[1]
"""The checkout."""

DONE, FAILED = "DONE", "FAILED"
"""Marker files of a run folder: finished, and ended by an error (which it holds)."""

PACKAGES = (
    "clarke_gym",
    "gymnasium",
    "mujoco",
    "numpy",
    "sb3_contrib",
    "stable_baselines3",
    "torch",
)
"""Packages whose versions a manifest records, where they are installed."""


class ConfigError(ValueError):
    """A configuration that cannot be used; the message says where and why."""


def run_folder(study: Path, arm: str, seed: int) -> Path:
    """Return the folder of one run.

    Examples
    --------
    >>> run_folder(Path("runs/quick"), "raw_n3", 4).as_posix()
    'runs/quick/raw_n3/seed_04'
    """
    return study / arm / f"seed_{seed:02d}"


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that readers see the old one or the whole new one, never a part."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            os.fchmod(file.fileno(), 0o644)  # mkstemp hides the file from everybody else
        os.replace(name, path)  # noqa: PTH105
    except BaseException:
        with suppress(FileNotFoundError):
            Path(name).unlink()
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    write_bytes(path, text.encode())


def write_npz(path: Path, arrays: dict[str, Any]) -> None:
    """Write arrays atomically; equal arrays give equal bytes."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    write_bytes(path, buffer.getvalue())


def keep_or_write_yaml(path: Path, data: dict[str, Any]) -> None:
    """Write a configuration once; refuse to replace one that says something else.

    Raises
    ------
    ConfigError
        If the file exists with other content: the runs beside it belong to that content.
    """
    if path.exists():
        old = yaml.safe_load(path.read_text())
        if old != data:
            keys = sorted(key for key in {*old, *data} if old.get(key) != data.get(key))
            raise ConfigError(
                f"{path} holds another configuration (different: {', '.join(keys)}); "
                "nothing was changed. Choose another name or --out, or move that folder away."
            )
        return
    write_text(path, yaml.safe_dump(data, sort_keys=False))


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock; the system frees it when the process dies, however it dies.

    Raises
    ------
    RuntimeError
        If another process is writing into the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RuntimeError(f"{folder} is in use by another process") from None
        yield


def _git(*arguments: str) -> str:
    result = subprocess.run(
        ["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    return result.stdout.strip() if result.returncode == 0 else "unknown"


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def write_manifest(path: Path, extra: dict[str, Any]) -> None:
    """Write where results come from: code, packages, command, machine, and `extra`."""
    manifest = {
        "git_sha": _git("rev-parse", "HEAD"),
        "git_dirty": _git("status", "--porcelain", "--untracked-files=no") not in ("", "unknown"),
        "packages": {name: version for name in PACKAGES if (version := _version(name))},
        "python": platform.python_version(),
        "command": shlex.join(sys.argv),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        **extra,
    }
    write_text(path, json.dumps(manifest, indent=2) + "\n")
