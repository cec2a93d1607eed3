"""YAML as this program reads and writes it: plain data, no key twice, bounded."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import yaml

from agents.files import ConfigError, write_text

MAX_CHARACTERS = 1_000_000
"""Longest text; the largest shipped study has 2,000 characters."""

MAX_REPEATED = 100_000
"""Items that the aliases of a text may repeat, all together."""

_EXPONENT = re.compile(r"^[-+]?[0-9]+(?:\.[0-9]*)?[eE][-+]?[0-9]+$")


class _Loader(yaml.SafeLoader):
    repeated = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        alias = self.peek_event() if self.check_event(yaml.AliasEvent) else None
        node = super().compose_node(parent, index)
        if alias is not None:  # PyYAML writes lists that occur twice so; more could fill the memory
            parts = node.value if isinstance(node, yaml.CollectionNode) else []
            self.repeated += len(parts)
            flat = all(isinstance(part, yaml.ScalarNode) for part in parts)
            if not flat or self.repeated > MAX_REPEATED:
                raise yaml.YAMLError(
                    f"the alias *{alias.anchor} in line {alias.start_mark.line + 1} repeats more "
                    "than a short list; write the value out"
                )
        return node

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        keys = [self.construct_object(key, deep=True) for key, _ in node.value]
        for i, key in enumerate(keys):
            if key in keys[:i]:
                line = node.value[i][0].start_mark.line + 1
                raise yaml.YAMLError(f"line {line}: the key {key!r} stands there twice")
        return super().construct_mapping(node, deep)


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        del data
        return True


for _class in (_Loader, _Dumper):  # 3e4 is a number; a text that looks like one is quoted
    _class.add_implicit_resolver("tag:yaml.org,2002:float", _EXPONENT, list("-+0123456789"))


def parse_yaml(text: str, where: str) -> Any:
    """Return the data in a YAML text.

    Raises
    ------
    ConfigError
        Naming `where`, in one line.

    Examples
    --------
    >>> parse_yaml("{steps: 3e4}", "here")
    {'steps': 30000.0}
    """
    if len(text) > MAX_CHARACTERS:
        raise ConfigError(f"{where}: more than {MAX_CHARACTERS:,} characters are not read")
    try:
        return yaml.load(text, _Loader)
    except RecursionError:
        raise ConfigError(f"{where}: nested too deeply") from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise ConfigError(f"{where}: {' '.join(str(error).split())}") from None


def read_yaml(path: Path) -> dict[str, Any]:
    """Return the mapping in a YAML file.

    Raises
    ------
    ConfigError
        If the file is missing, is not YAML or does not hold a mapping.
    """
    try:
        with path.open(encoding="utf-8") as file:
            text = file.read(MAX_CHARACTERS + 1)
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: not a text in UTF-8") from None
    except OSError as error:
        raise ConfigError(f"{path}: {error.strerror}") from None
    data = parse_yaml(text, str(path))
    if not isinstance(data, dict):
        found = "an empty file" if data is None else type(data).__name__
        raise ConfigError(f"{path}: expected a mapping of settings, got {found}")
    return data


def yaml_text(data: dict[str, Any]) -> str:
    """Return data as YAML that `parse_yaml` reads back equal."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False)


def keep_or_write_yaml(path: Path, data: dict[str, Any]) -> None:
    """Write a configuration once; refuse to replace one that says something else.

    Raises
    ------
    ConfigError
        If the file exists with other content: the runs beside it belong to that content.
    """
    if not path.exists():
        write_text(path, yaml_text(data))
        return
    if keys := differences(read_yaml(path), data):
        raise ConfigError(
            f"{path} holds another configuration (different: {', '.join(keys)}); "
            "nothing was changed. Choose another name or --out, or move that folder away."
        )


def differences(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    """Return the keys whose values differ."""
    return sorted(str(key) for key in {*old, *new} if old.get(key) != new.get(key))
