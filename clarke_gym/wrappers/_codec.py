"""What the scalar wrappers and their vector twins share: spaces, and the coded observation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from clarke_gym._arrays import not_finite
from clarke_gym._linear_map import LinearMap
from clarke_gym.envs.core import JOINT_BLOCKS, EnvCore
from clarke_gym.representations import Representation, make_representation, to_polar
from clarke_gym.robots import block_diagonal


def core_of(env: Any, wrapper: str) -> EnvCore:
    """Return the core under any wrappers, or say that this is not one of our environments."""
    core = getattr(env.unwrapped, "core", None)
    if not isinstance(core, EnvCore):
        raise TypeError(f"{wrapper} needs a clarke_gym environment, got {env!r}")
    return core


class ActionCodec:
    """Decodes actions to joint space."""

    def __init__(self, core: EnvCore, name: str) -> None:
        self.representation = make_representation(name, core.robot)
        self._size = self.representation.size
        self._decoder = LinearMap(self.representation.decoder.T)
        self.space = spaces.Box(-1.0, 1.0, (self._size,), np.float32)

    def decode(self, action: ArrayLike) -> NDArray[np.float64]:
        """Return the joint-space action in float64, so that it is on the manifold to rounding."""
        array = np.asarray(action, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self._size:
            raise ValueError(
                f"action must have a last axis of {self.representation.size} for the "
                f"representation {self.representation.name!r}, got shape {array.shape}"
            )
        # The few numbers of one action are checked faster as floats than by a call into NumPy.
        one = array.ndim == 1
        if not (all(map(math.isfinite, array.tolist())) if one else np.isfinite(array).all()):
            raise ValueError(not_finite(array))
        if one and not self.representation.polar:
            return self._decoder.of_numbers(array).copy()
        return self.representation.decode(array)


class ObservationCodec:
    """Encodes the joint blocks that lead an observation; the task's part stays as it is."""

    def __init__(self, core: EnvCore, name: str, space: spaces.Space[Any]) -> None:
        self.representation: Representation = make_representation(name, core.robot)
        blocks = len(JOINT_BLOCKS)
        manifold, off = core.joint_bounds()
        bound = self.representation.encoded_bound(core.robot, manifold, off)
        inner = space["observation"] if isinstance(space, spaces.Dict) else space
        tail = inner.high[blocks * core.robot.n_joints :]  # type: ignore[attr-defined]
        high = np.concatenate([np.tile(bound, blocks), tail])
        parts = [self.representation.encoder.T] * blocks + [np.eye(len(tail))]
        self._map = LinearMap(block_diagonal(parts).astype(np.float32))
        self._polar_size = blocks * self.representation.size if self.representation.polar else 0
        # The factor covers float32 rounding of the encoding itself.
        high = (high * (1.0 + 1e-6)).astype(np.float32)
        box = spaces.Box(-high, high, dtype=np.float32)
        self.space: spaces.Space[Any] = box
        if isinstance(space, spaces.Dict):
            self.space = spaces.Dict({**space.spaces, "observation": box})

    def encode(self, observation: Any) -> Any:
        """Return the observation with its joint blocks encoded, as new arrays."""
        if isinstance(observation, dict):
            return {**observation, "observation": self._encode(observation["observation"])}
        return self._encode(observation)

    def _encode(self, rows: NDArray[np.float32]) -> NDArray[np.float32]:
        coded: NDArray[np.float32]
        coded = self._map.of_rows(rows) if rows.ndim == 2 else self._map.of_numbers(rows).copy()
        if self._polar_size:
            to_polar(coded[..., : self._polar_size])
        return coded
