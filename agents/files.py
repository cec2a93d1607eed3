"""Run folders: where they lie, whose they are, atomic writes, one writer at a time, hashes.

Nothing is deleted or replaced here that this program did not write, and no link is followed.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import importlib.metadata
import io
import json
import os
import platform
import shlex
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
"""The checkout."""

CONFIG, MANIFEST, EVALS = "config.yaml", "manifest.json", "evals.npz"
"""Files of a run folder: what was asked for, where results come from, and the results."""

GOALS = "goal_position_m"
"""Array of the results: where the held-out goals are."""

TRIALS = "tuning.csv"
"""File of a tuning: every trial."""

DONE, FAILED = "DONE", "FAILED"
"""Marker files of a run folder: finished (the SHA-256 of its manifest), and a policy that is no
longer finite (the reason). DONE wins over FAILED."""

PART = ".part-"
"""What the names of unfinished files and folders begin with."""

PACKAGES = (
    "clarke_gym",
    "gymnasium",
    "mujoco",
    "numpy",
    "safetensors",
    "sb3_contrib",
    "stable_baselines3",
    "torch",
)
"""Packages whose versions a manifest records, where they are installed."""


class ConfigError(ValueError):
    """A configuration that cannot be used; the message says where and why."""


class InUse(RuntimeError):
    """Another process is writing into a folder."""


def run_folder(study: Path, arm: str, seed: int) -> Path:
    """Return the folder of one run.

    Examples
    --------
    >>> run_folder(Path("runs/quick"), "raw_n3", 4).as_posix()
    'runs/quick/raw_n3/seed_04'
    """
    return study / arm / f"seed_{seed:02d}"


# --- writing ----------------------------------------------------------------------------------


def _file_system(path: Path) -> Path:
    path = path.resolve()
    return next((parent for parent in (path, *path.parents) if parent.is_mount()), path)


@contextmanager
def naming_full_disks(path: Path) -> Iterator[None]:
    """Let an error of a full disk say which file system it is."""
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            raise OSError(
                error.errno,
                f"no space left on the file system of {_file_system(path.parent)} for {path}; "
                "free some and run the same command again",
            ) from error
        raise


def fsync_folder(folder: Path) -> None:
    """Ask the disk to keep the folder's names."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file so that readers see the old one or the whole new one, even after power loss.

    The folder must be there: one that somebody deletes does not come back half filled.
    """
    with naming_full_disks(path):
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f"{PART}{path.name}-")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(data)
                os.fchmod(file.fileno(), 0o644)  # mkstemp hides the file from everybody else
                file.flush()
                os.fsync(file.fileno())
            os.replace(name, path)  # noqa: PTH105
        except BaseException:
            with suppress(FileNotFoundError):
                Path(name).unlink()
            raise
        fsync_folder(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    write_bytes(path, text.encode())


def npz_bytes(arrays: dict[str, Any]) -> bytes:
    """Return arrays as an uncompressed npz; equal arrays give equal bytes."""
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def read_npz(data: bytes) -> dict[str, Any]:
    """Return the arrays of an npz; one that is compressed or needs pickle is refused.

    Raises
    ------
    ValueError
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if any(entry.compress_type != zipfile.ZIP_STORED for entry in archive.infolist()):
            raise ValueError("compressed arrays are not read: a small file could fill the memory")
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        return {name: file[name] for name in file.files}


# --- whose it is ------------------------------------------------------------------------------


def refuse_foreign(folder: Path, marker: str) -> None:
    """Refuse a folder that holds something without being one of this program's.

    Parameters
    ----------
    folder : Path
    marker : str
        File that such a folder has from the first moment on.

    Raises
    ------
    ConfigError
        If the folder is not empty and has no such file; nothing was changed.
    """
    if (folder / marker).is_file() or not folder.exists():
        return
    names = sorted(p.name for p in folder.iterdir() if p.name != ".lock" and not is_part(p.name))
    if names:
        raise ConfigError(
            f"{folder} holds {names[0]!r}{' and more' if names[1:] else ''} but no {marker}: it is "
            "not this program's folder. Nothing was changed; choose another --out"
        )


def refuse_links(folder: Path, names: Iterable[str]) -> None:
    """Refuse files and folders that are links: what they point at belongs to somebody.

    Raises
    ------
    ConfigError
    """
    for name in names:
        if (folder / name).is_symlink():
            raise ConfigError(f"{folder / name} is a link, which is not followed; move it away")


def is_part(name: str) -> bool:
    """Return whether a name is that of something unfinished of this program's."""
    return name.startswith(PART)


def remove_own_folder(folder: Path, names: Iterable[str]) -> bool:
    """Remove the named files of a folder, and the folder if nothing else was in it.

    Returns
    -------
    bool
        False if something remains, which this program did not write.
    """
    if folder.is_symlink() or not folder.is_dir():
        return False
    names = set(names)
    for path in folder.iterdir():
        if path.name not in names and not is_part(path.name):
            continue
        if path.is_dir() and not path.is_symlink():
            remove_own_folder(path, names)
        else:
            path.unlink()  # a link goes, its target stays
    try:
        folder.rmdir()
    except OSError:
        return False
    return True


def sweep(folder: Path, names: Iterable[str] = ()) -> None:
    """Remove what writers that died left unfinished; call it with the folder's lock held.

    Parameters
    ----------
    folder : Path
    names : iterable of str
        Files that unfinished folders in it may hold.
    """
    if folder.is_symlink() or not folder.is_dir():
        return
    for path in folder.iterdir():
        if not is_part(path.name):
            continue
        if path.is_dir() and not path.is_symlink():
            remove_own_folder(path, names)
        elif path.is_file() and not path.is_symlink():
            path.unlink()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock; the system frees it when the process dies, however it dies.

    Raises
    ------
    ConfigError
        If the lock is a link.
    InUse
        If another process is writing into the folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK
    try:
        handle = os.open(folder / ".lock", flags, 0o644)
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise ConfigError(f"{folder / '.lock'} is a link, which is not followed") from None
        raise
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InUse(f"{folder} is in use by another process") from None
        yield
    finally:
        os.close(handle)


# --- where results come from ------------------------------------------------------------------


def sha256(data: bytes) -> str:
    """Return the SHA-256 in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


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


def finish(folder: Path, results: Iterable[str], extra: dict[str, Any]) -> None:
    """Write the manifest of a run and, last of all, DONE.

    The manifest says where results come from (code, packages, command, machine, `extra`) and holds
    the SHA-256 of every file of `results`; DONE holds that of the manifest.
    """
    manifest = {
        "git_sha": _git("rev-parse", "HEAD"),
        "git_dirty": _git("status", "--porcelain", "--untracked-files=no") not in ("", "unknown"),
        "packages": {name: version for name in PACKAGES if (version := _version(name))},
        "python": platform.python_version(),
        "command": shlex.join(sys.argv),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        **extra,
        "sha256": {name: sha256((folder / name).read_bytes()) for name in results},
    }
    text = json.dumps(manifest, indent=2) + "\n"
    write_text(folder / MANIFEST, text)
    (folder / FAILED).unlink(missing_ok=True)
    write_text(folder / DONE, sha256(text.encode()) + "\n")


def has_failed(folder: Path) -> bool:
    """Return whether a run folder says that its policy is no longer finite."""
    return (folder / FAILED).exists() and not (folder / DONE).exists()


def is_over(folder: Path) -> bool:
    """Return whether a run is not to be carried out any more: finished, or failed for good."""
    return any((folder / marker).exists() for marker in (DONE, FAILED))


def damage(folder: Path) -> str | None:
    """Return what of a finished run is not as it was written, or None.

    Runs of version 0.1 have no hashes (their DONE is empty); they are taken as they are.
    """
    done = (folder / DONE).read_bytes()
    if not done:
        return None
    try:
        manifest = (folder / MANIFEST).read_bytes()
        if done != f"{sha256(manifest)}\n".encode():
            return f"{folder / MANIFEST} is not as {DONE} says"
        for name, digest in json.loads(manifest)["sha256"].items():
            if sha256((folder / name).read_bytes()) != digest:
                return f"{folder / name} is not as {MANIFEST} says"
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        return f"{folder}: {type(error).__name__}: {error}"
    return None
