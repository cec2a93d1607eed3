"""Trained policies without a learning library: a small network read and evaluated with NumPy."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray

_TYPES = {"F32": np.float32, "F64": np.float64}
_LAYERS = "mlp_extractor.policy_net."


class NetworkPolicy:
    """A deterministic policy: layers of tanh, a linear layer at the end, clipped to [-1, 1].

    Parameters
    ----------
    layers : list of (ndarray of shape (out, in), ndarray of shape (out,))
        Weights and biases, first layer first.
    about : dict
        What ``policy.json`` says: the environment, its spaces, how it was trained.

    Raises
    ------
    ValueError
        If the layers do not fit together.

    Examples
    --------
    >>> policy = NetworkPolicy([(np.array([[3.0, 0.0]]), np.array([0.5]))], {})
    >>> policy.act(np.array([0.0, 1.0])), policy.act(np.array([[1.0, 1.0], [-1.0, 1.0]]))[:, 0]
    (array([0.5], dtype=float32), array([ 1., -1.], dtype=float32))
    """

    def __init__(
        self, layers: list[tuple[NDArray[Any], NDArray[Any]]], about: dict[str, Any]
    ) -> None:
        self.layers = [(np.asarray(w, np.float64), np.asarray(b, np.float64)) for w, b in layers]
        self.about = about
        width = self.layers[0][0].shape[1] if self.layers else 0
        for weight, bias in self.layers:
            if weight.ndim != 2 or bias.shape != weight.shape[:1] or weight.shape[1] != width:
                raise ValueError(
                    f"layers must follow each other, got {[w.shape for w, _ in self.layers]}"
                )
            width = weight.shape[0]

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions.

        Parameters
        ----------
        observation : array_like, shape (..., observation size), or dict of such
            The parts of a dictionary (``goal_env=True``) go one after the other by their names, as
            in training: achieved goal, desired goal, observation.

        Returns
        -------
        ndarray of float32, shape (..., action size)

        Raises
        ------
        ValueError
            If it has another size: that of another representation, task or number of tendons.
        """
        if isinstance(observation, dict):
            observation = np.concatenate([observation[name] for name in sorted(observation)], -1)
        values: FloatArray = np.asarray(observation, np.float64)
        size = self.layers[0][0].shape[1]
        if values.shape[-1:] != (size,):
            kwargs = self.about.get("env", {}).get("kwargs", {})
            raise ValueError(
                f"this policy takes observations of {size} numbers, got the shape {values.shape}; "
                f"it was trained with {kwargs}"
            )
        *hidden, (weight, bias) = self.layers
        for inner, offset in hidden:
            values = np.tanh(values @ inner.T + offset)
        result: NDArray[np.float32] = np.clip(values @ weight.T + bias, -1.0, 1.0).astype(
            np.float32
        )
        return result

    def reset(self) -> None:
        """Nothing to forget."""


def load_policy(folder: str | Path) -> NetworkPolicy:
    """Read the policy of a folder with ``policy.safetensors`` and ``policy.json``.

    Such folders are in ``policies/`` of the checkout and in every run of PPO. Reading executes
    nothing.

    Parameters
    ----------
    folder : str or Path

    Returns
    -------
    NetworkPolicy

    Raises
    ------
    ValueError
        If the files are damaged or hold no network of tanh layers.
    OSError
        If they cannot be read.

    Examples
    --------
    >>> policy = load_policy("policies/reach")  # in the checkout
    >>> policy.act(np.zeros((5, 13))).shape
    (5, 2)
    """
    folder = Path(folder)
    about = json.loads((folder / "policy.json").read_text(encoding="utf-8"))
    if not isinstance(about, dict):
        raise ValueError(f"{folder / 'policy.json'} holds no description of a policy")
    path = folder / "policy.safetensors"
    tensors = _read_tensors(path)
    names = sorted(
        (name for name in tensors if name.startswith(_LAYERS) and name.endswith(".weight")),
        key=lambda name: int(name.split(".")[-2]),
    )
    names.append("action_net.weight")
    if about.get("algorithm") != "ppo" or any(name not in tensors for name in names):
        raise ValueError(f"{path} holds no policy of PPO, which is a network of tanh layers")
    if lacking := [n for name in names if (n := name.replace(".weight", ".bias")) not in tensors]:
        raise ValueError(f"{path} lacks {lacking}")
    layers = [(tensors[name], tensors[name.replace(".weight", ".bias")]) for name in names]
    gain = about.get("output_gain", about.get("settings", {}).get("mean_gain", 1.0))
    if isinstance(gain, str):  # "matched", of an older run
        raise ValueError(f"{folder / 'policy.json'} does not say by what the output is multiplied")
    weight, bias = layers[-1]
    layers[-1] = (gain * weight, gain * bias)
    return NetworkPolicy(layers, about)


def _read_tensors(path: Path) -> dict[str, NDArray[Any]]:
    """Return the tensors of a safetensors file: a length, a header in JSON, and the numbers."""
    data = path.read_bytes()
    try:
        start = 8 + int.from_bytes(data[:8], "little")
        header = json.loads(data[8:start])
        return {
            name: np.frombuffer(
                data[start + entry["data_offsets"][0] : start + entry["data_offsets"][1]],
                _TYPES[entry["dtype"]],
            ).reshape(entry["shape"])
            for name, entry in header.items()
            if name != "__metadata__"
        }
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path} is no safetensors file: {error}") from None
