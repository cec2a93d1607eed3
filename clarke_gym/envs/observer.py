"""Observations: the concatenation of what sensors read, joint-space blocks first."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym.envs.told import check_sensors
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Batch
from clarke_gym.physics.base import RobotState
from clarke_gym.representations import Representation
from clarke_gym.representations.codecs import Encoder
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.robots.robot import Robot
from clarke_gym.sensors import JointSensor, Sensor, TaskSensor

Sensed: TypeAlias = Callable[[str, FloatArray | float, FloatArray], FloatArray]
"""Name, scale and true values (B, k) of a sensor -> what it tells."""


@dataclass(frozen=True)
class Block:
    """Where a sensor stands in an observation, and what its numbers mean.

    Parameters
    ----------
    name : str
    place : slice
        Of the observation.
    labels : tuple of str
        A name for each entry.
    unit : str
        Of the numbers before they are scaled.
    scale : ndarray
        What an entry of a task-space block is divided by, shape (1,); for joint space a number for
        each tendon, shape (N,), in joint space.
    high : ndarray of float32
        Bounds of the entries; the lower ones are their negatives.
    reach : tuple of (float, ndarray of shape (N,)), or None
        Of a block in joint space, which is written in the representation: largest magnitude of its
        scaled Clarke coordinates, and of its off-manifold numbers.
    """

    name: str
    place: slice
    labels: tuple[str, ...]
    unit: str
    scale: FloatArray
    high: NDArray[np.float32]
    reach: tuple[float, FloatArray] | None


class Blocks(Mapping[str, Block]):
    """The sensors of an environment by name, in the order of the observation.

    Parameters
    ----------
    blocks : sequence of Block

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> env = gymnasium.make("clarke_gym/Reach-v0", n_tendons=7, representation="clarke")
    >>> sensors = env.unwrapped.sensors
    >>> list(sensors), sensors["goal"].place
    (['command', 'displacement', 'tip_position', 'goal', 'goal_gap'], slice(7, 10, None))
    """

    def __init__(self, blocks: Sequence[Block]) -> None:
        self._blocks = {block.name: block for block in blocks}

    def __getitem__(self, name: str) -> Block:
        return self._blocks[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._blocks)

    def __len__(self) -> int:
        return len(self._blocks)

    def table(self) -> str:
        """Return a Markdown table with a row for each entry of the observation."""
        rows = [
            "| entry | sensor | number | unit | divided by | bound |",
            "|---|---|---|---|---|---|",
        ]
        for block in self.values():
            scale = np.unique(block.scale.round(12))
            for k, label in enumerate(block.labels):
                divided = f"{scale[0]:.6g}" if len(scale) == 1 else "limit of its segment"
                if block.reach is None:
                    divided = f"{block.scale[min(k, len(block.scale) - 1)]:.6g}"
                entry, bound = block.place.start + k, block.high[k]
                rows.append(
                    f"| {entry} | {block.name} | {label} | {block.unit} | {divided} | {bound:.6g} |"
                )
        return "\n".join(rows)


class Observer:
    """Writes observations.

    Parameters
    ----------
    sensors : sequence of Sensor
    robot : Robot
    representation : Representation
        Of joint-space blocks.
    batch : Batch
    sensed : callable, optional
        Turns name, scale and true values (B, k) of a sensor into what it tells.
    """

    def __init__(
        self,
        sensors: Sequence[Sensor],
        robot: Robot,
        representation: Representation,
        batch: Batch,
        sensed: Sensed | None = None,
    ) -> None:
        self._sensed, self._looked_at = sensed, False
        self.representation = representation
        self._batch = batch
        self._joint = [sensor for sensor in sensors if isinstance(sensor, JointSensor)]
        self._task = [sensor for sensor in sensors if isinstance(sensor, TaskSensor)]
        self._encoder: Encoder | None = None
        blocks: list[Block] = []
        end = 0
        if self._joint:
            self._encoder = Encoder(
                representation,
                robot,
                [sensor.scale for sensor in self._joint],
                [sensor.bound for sensor in self._joint],
                sensed is not None or any(sensor.passes for sensor in self._joint),
            )
            labels = representation.labels
            for sensor in self._joint:
                place = slice(end, end + representation.size)
                scale = np.repeat(sensor.scale, robot.n_tendons)
                high = self._encoder.high[place]
                blocks.append(
                    Block(sensor.name, place, labels, sensor.unit, scale, high, sensor.bound)
                )
                end = place.stop
            self._splitter = Splitter(robot, batch, self._encoder.sees_off)
        self._start = end
        for seen in self._task:
            place = slice(end, end + len(seen.labels))
            high = np.full(len(seen.labels), seen.bound, np.float32)
            scale = np.atleast_1d(seen.scale)
            blocks.append(Block(seen.name, place, seen.labels, seen.unit, scale, high, None))
            end = place.stop
        self.width = end
        self.blocks = Blocks(blocks)
        self.high = np.concatenate([block.high for block in blocks]).astype(np.float32)
        self._places = [(sensor, self.blocks[sensor.name].place) for sensor in self._task]

    def write(self, state: RobotState, goal: FloatArray) -> NDArray[np.float32]:
        """Return observations as a new array, shape (B, width)."""
        if not self._looked_at:
            joint = [(sensor, sensor.read(state)) for sensor in self._joint]
            task = [(sensor, sensor.read(state, goal)) for sensor in self._task]
            check_sensors([*joint, *task], self._batch.size, self.representation.n_joints)
            self._looked_at = True
        # Columns are long where rows are short, and NumPy writes long runs faster.
        rows = np.empty((self.width, self._batch.size), np.float32).T
        if self._encoder is not None:
            vectors = [self._vector(sensor, state) for sensor in self._joint]
            self._encoder.write(vectors, rows[:, : self._start])
        for sensor, place in self._places:
            if self._sensed is None or not sensor.measured:
                rows[:, place] = sensor.observed(state, goal)
            else:
                scale = sensor.scale
                told = self._sensed(sensor.name, scale, sensor.read(state, goal)) / scale
                rows[:, place] = np.minimum(np.maximum(told, -sensor.bound), sensor.bound)
        return np.ascontiguousarray(rows)

    def _vector(self, sensor: JointSensor, state: RobotState) -> JointVector:
        """Return what a sensor in joint space tells, split by the projector."""
        if self._sensed is None or not sensor.measured:
            return sensor.vector(state, self._splitter)
        scale = self.blocks[sensor.name].scale
        return self._splitter.rows(self._sensed(sensor.name, scale, sensor.read(state)))
