"""What a preregistration is: the hash of a study's file without what may still change."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from agents.files import sha256

FREE = ("seeds", "title", "note", "arms", "total_steps", "registered")
"""What is not hashed: seeds may be added and words improved; the rest follows from what is."""


def registration(study: Mapping[str, Any]) -> str:
    """Return the SHA-256 of question, rule, arms, tasks, base run and thresholds of a study.

    Parameters
    ----------
    study : mapping
        What study.yaml holds.

    Examples
    --------
    >>> one = {"name": "a", "seeds": [1], "preregistration": {"rule": "x"}}
    >>> registration(one) == registration(one | {"seeds": [1, 2]})
    True
    >>> registration(one) == registration(one | {"preregistration": {"rule": "y"}})
    False
    """
    data = {name: value for name, value in study.items() if name not in FREE}
    return sha256(json.dumps(data, sort_keys=True).encode())
