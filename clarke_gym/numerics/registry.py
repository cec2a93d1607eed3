"""Things by name, and errors that say which names there are."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable
from typing import Generic, TypeVar

T = TypeVar("T")

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def nearest(name: object, names: Iterable[str]) -> str:
    """Return a hint at the most similar name, or nothing where none is similar.

    Examples
    --------
    >>> nearest("n_tendon", ["n_tendons", "robot"])
    "; did you mean 'n_tendons'?"
    """
    found = difflib.get_close_matches(str(name), list(names), 1)
    return f"; did you mean {found[0]!r}?" if found else ""


class Registry(Generic[T]):
    """A table that users extend.

    Parameters
    ----------
    kind : str
        What the table holds, for messages.

    Examples
    --------
    >>> colours = Registry("colour")
    >>> colours.register("red", 1)
    >>> colours["red"], colours.names()
    (1, ['red'])
    """

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self._entries: dict[str, T] = {}
        self._reserved: set[str] = set()

    def reserve(self, names: Iterable[str]) -> None:
        """Keep names that mean something else where entries are named."""
        self._reserved.update(names)

    def register(self, name: str, entry: T) -> None:
        """Add an entry.

        Raises
        ------
        ValueError
            If the name is taken by another entry or means something else, or is no word of letters,
            digits and "_".
        """
        self._check(name, entry)
        self._entries[name] = entry

    def _check(self, name: str, entry: T) -> None:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise ValueError(
                f"a {self.kind} needs a name of letters, digits and '_' that begins with a letter, "
                f"got {name!r}"
            )
        there = self._entries.get(name, entry)
        if there is not entry and not (isinstance(entry, str) and there == entry):
            raise ValueError(f"{self.kind} {name!r} is registered already; choose another name")
        if name in self._reserved:
            raise ValueError(f"{self.kind} {name!r} stands for something else; choose another name")

    def decorator(self, name: str, base: type) -> Callable[[T], T]:
        """Return a decorator that registers a class, and gives it the name.

        Raises
        ------
        ValueError, TypeError
            If the name is taken, or what is decorated is no subclass of `base`, or has another name
            already.
        """

        def register(entry: T) -> T:
            if not (isinstance(entry, type) and issubclass(entry, base)):
                raise TypeError(f"a {self.kind} is a subclass of {base.__name__}, got {entry!r}")
            self._check(name, entry)
            known = next((other for other in self._entries if self._entries[other] is entry), name)
            if known != name:
                raise ValueError(
                    f"{entry.__name__} is the {self.kind} {known!r} already; register a subclass "
                    f"as {name!r}"
                )
            self._entries[name] = entry
            entry.name = name  # type: ignore[attr-defined]
            return entry

        return register

    def __getitem__(self, name: str) -> T:
        """Return an entry.

        Raises
        ------
        ValueError
            If there is none; the message has the nearest name and all of them.
        """
        try:
            return self._entries[name]
        except (KeyError, TypeError):
            hint = nearest(name, self._entries)
            raise ValueError(
                f"{self.kind} must be one of {self.names()}, got {name!r}{hint}"
            ) from None

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def names(self) -> list[str]:
        """Return all names, in the order in which they were registered."""
        return list(self._entries)
