"""What sensors do to true values: noise, bias, steps, delay."""

from __future__ import annotations

import zlib
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.disturbances.base import Disturbance, register_disturbance
from clarke_gym.numerics.ahead import Ahead
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.noise import normals, uniforms
from clarke_gym.robots.robot import Robot

NOISE = 0.02
"""Standard deviation of the noise, over what values are divided by."""

BIAS = 0.02
"""Largest offset, likewise."""

STEP = 0.02
"""Step of quantised values, likewise."""

MOST_DELAY = 2
"""Longest delay of what sensors tell, in control periods."""


def _stream(name: str) -> int:
    """Return a number for a sensor's name that is the same in every process."""
    return zlib.crc32(name.encode())


@register_disturbance("sensor_noise")
class SensorNoise(Disturbance):
    """White noise of normal numbers on every measured value."""

    numbers: ClassVar[int] = 1

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._noise: dict[str, Ahead] = {}

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin with noise of new episodes."""
        del numbers, command
        for noise in self._noise.values():
            noise.forget(rows)

    def sense(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return the values with noise."""
        if name not in self._noise:
            self._noise[name] = Ahead()

        def tell(rows: NDArray[np.intp], steps: NDArray[np.int64]) -> FloatArray:
            noise = normals(self.drawn[rows, 0], steps, values.shape[1], _stream(name))
            return NOISE * self.strength * scale * noise

        return values + self._noise[name].at(self.steps, tell)

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to what was drawn."""
        del state
        self._noise.clear()


@register_disturbance("sensor_bias")
class SensorBias(Disturbance):
    """An offset of every measured value, drawn for every episode."""

    numbers: ClassVar[int] = 1

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._offsets: dict[str, FloatArray] = {}

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin with offsets of new episodes."""
        del rows, numbers, command
        self._offsets.clear()

    def sense(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return the values with their offsets."""
        if name not in self._offsets:
            places = np.zeros(len(values), np.int64)
            offset = uniforms(self.drawn[:, 0], places, values.shape[1], _stream(name))
            self._offsets[name] = BIAS * self.strength * scale * (2.0 * offset - 1.0)
        return values + self._offsets[name]

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to what was drawn."""
        del state
        self._offsets.clear()


@register_disturbance("quantisation")
class Quantisation(Disturbance):
    """Measured values come in steps."""

    def sense(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return the nearest steps."""
        del name
        step = STEP * self.strength * scale
        return step * np.round(values / step)


@register_disturbance("sensor_delay")
class SensorDelay(Disturbance):
    """Measured values are 0 to 2 control periods old, a number drawn for every episode."""

    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._longest = max(1, round(MOST_DELAY * strength))
        self._kept: dict[str, FloatArray] = {}

    def sense(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return the values of some steps ago, at least those that the episode began with."""
        del scale
        places, rows = self._longest + 1, np.arange(self.num_envs)
        if name not in self._kept:
            self._kept[name] = np.zeros((self.num_envs, places, values.shape[1]))
        ring = self._kept[name]
        ring[rows, self.steps % places] = values
        late = np.floor(self.drawn[:, 0] * places).astype(np.int64)
        told: FloatArray = ring[rows, np.maximum(self.steps - late, 0) % places]
        return told

    def get_state(self) -> dict[str, Any]:
        """Return what is kept of the last steps."""
        return {"kept": {name: ring.copy() for name, ring in self._kept.items()}}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to it."""
        self._kept = {name: ring.copy() for name, ring in state["kept"].items()}
