"""State as files that no reader executes: JSON for its shape, npz for arrays, safetensors.

`encode_state` takes nested dictionaries, lists, tuples and deques of numbers, texts, None, NumPy
arrays, NumPy generators and torch tensors; anything else is refused by its name.
"""

from __future__ import annotations

import json
from collections import deque
from typing import Any

import numpy as np
import safetensors.torch
import torch

from agents.files import npz_bytes, read_npz

STATE, ARRAYS, TENSORS = "state.json", "arrays.npz", "tensors.safetensors"
FILES = (STATE, ARRAYS, TENSORS)

_KIND = "$"
_BIT_GENERATORS = {
    kind.__name__: kind
    for kind in (
        np.random.PCG64,
        np.random.PCG64DXSM,
        np.random.MT19937,
        np.random.Philox,
        np.random.SFC64,
    )
}


class _Encoder:
    def __init__(self) -> None:
        self.arrays: dict[str, Any] = {}
        self.tensors: dict[str, torch.Tensor] = {}

    def encode(self, value: Any, at: str) -> Any:
        if value is None or type(value) in (bool, int, float, str):
            return value
        if isinstance(value, list):
            return [self.encode(item, f"{at}[{i}]") for i, item in enumerate(value)]
        if isinstance(value, tuple):
            return {_KIND: "tuple", "items": self.encode(list(value), at)}
        if isinstance(value, deque):
            items = self.encode(list(value), at)
            return {_KIND: "deque", "items": items, "maxlen": value.maxlen}
        if isinstance(value, dict):
            items = [[self.encode(k, at), self.encode(v, f"{at}.{k}")] for k, v in value.items()]
            return {_KIND: "dict", "items": items}
        if isinstance(value, torch.Tensor):
            name = f"t{len(self.tensors)}"
            self.tensors[name] = value.detach().cpu().contiguous().clone()
            return {_KIND: "tensor", "name": name}
        if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biufcSU":
            name = f"a{len(self.arrays)}"
            self.arrays[name] = value
            kind = "array" if isinstance(value, np.ndarray) else "number"
            return {_KIND: kind, "name": name}
        if isinstance(value, np.random.Generator):
            return {_KIND: "generator", "state": self.encode(value.bit_generator.state, at)}
        raise TypeError(f"{at}: a {type(value).__name__} cannot be kept in a checkpoint")


def encode_state(state: dict[str, Any]) -> dict[str, bytes]:
    """Return the contents of the three files that hold a state.

    Raises
    ------
    TypeError
        If something in it is no plain data; the message says where.
    """
    encoder = _Encoder()
    tree = encoder.encode(state, "state")
    return {
        STATE: json.dumps(tree).encode(),
        ARRAYS: npz_bytes(encoder.arrays),
        TENSORS: safetensors.torch.save(encoder.tensors),
    }


class _Decoder:
    def __init__(self, arrays: dict[str, Any], tensors: dict[str, torch.Tensor]) -> None:
        self.arrays, self.tensors = arrays, tensors

    def decode(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self.decode(item) for item in node]
        if not isinstance(node, dict):
            return node
        match node[_KIND]:
            case "tuple":
                return tuple(self.decode(node["items"]))
            case "deque":
                return deque(self.decode(node["items"]), node["maxlen"])
            case "dict":
                return {self.decode(key): self.decode(value) for key, value in node["items"]}
            case "tensor":
                return self.tensors[node["name"]]
            case "array":
                return self.arrays[node["name"]]
            case "number":
                return self.arrays[node["name"]][()]
            case "generator":
                state = self.decode(node["state"])
                bits = _BIT_GENERATORS[state["bit_generator"]]()
                bits.state = state
                return np.random.Generator(bits)
        raise ValueError(f"unknown kind {node[_KIND]!r}")


def decode_state(files: dict[str, bytes]) -> Any:
    """Return the state that `encode_state` was given.

    Raises
    ------
    ValueError, KeyError, TypeError
        If the files do not hold a state.
    """
    tensors = safetensors.torch.load(files[TENSORS])
    return _Decoder(read_npz(files[ARRAYS]), tensors).decode(json.loads(files[STATE]))
