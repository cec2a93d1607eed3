"""Plug-ins: modules of the user that a configuration names, imported before anything is made.

Importing one registers what it adds (a task, a robot, a representation). Modules are found in the
working directory, then wherever Python finds modules. They are code, and configurations come from
anywhere: so a configuration's plug-ins are imported only if the command line names them as well.
"""

from __future__ import annotations

import hashlib
import importlib
import sys
from collections.abc import Iterable
from pathlib import Path

from agents.files import ConfigError

_allowed: set[str] = set()


def allow_plugins(names: Iterable[str]) -> None:
    """Let configurations name these modules; the command line does it for those of --plugins."""
    _allowed.update(names)


def allowed_plugins() -> list[str]:
    """Return what `allow_plugins` was given, for processes that work for this one."""
    return sorted(_allowed)


def import_plugins(names: Iterable[str]) -> dict[str, str | None]:
    """Import modules once each, in order.

    Parameters
    ----------
    names : iterable of str
        Dotted names of modules.

    Returns
    -------
    dict
        Module name -> SHA-256 of its file; None for a module that is no single file.

    Raises
    ------
    ConfigError
        If a module is not among the allowed, or cannot be imported, whatever it raised.
    """
    names = list(names)
    if strange := [name for name in names if name not in _allowed]:
        raise ConfigError(
            f"the configuration names the plug-ins {strange}, which are code that would run; "
            f"if you trust them, add --plugins {' '.join(strange)}"
        )
    here = str(Path.cwd())
    if names and here not in sys.path:
        sys.path.insert(0, here)
    found = {}
    for name in names:
        try:
            file = importlib.import_module(name).__file__
        except (Exception, SystemExit) as error:  # it runs the user's code
            raise ConfigError(
                f"plug-in {name!r} cannot be imported: {type(error).__name__}: {error} "
                f"(looked in {here}, then on the module path)"
            ) from error
        found[name] = hashlib.sha256(Path(file).read_bytes()).hexdigest() if file else None
    return found
