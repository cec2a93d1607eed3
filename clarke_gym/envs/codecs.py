"""Codecs between representations and the core: actions that it reads, observations that it writes.

The core lives in Clarke coordinates. A representation that spans the manifold is therefore mapped
by a small matrix, or by none at all, at a cost that does not depend on the number of tendons.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from operator import add, mul
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from clarke_gym.envs.limits import Reading, check_finite
from clarke_gym.numerics.arrays import Number, components
from clarke_gym.numerics.linear_map import LinearMap, block_diagonal, map_rows
from clarke_gym.physics.base import JointVector
from clarke_gym.representations.registry import make_representation, to_polar

if TYPE_CHECKING:
    from clarke_gym.envs.core import EnvCore

JOINT_BLOCKS = ("command", "displacement")
"""Joint-space parts that lead every observation, N numbers each."""

_SINGLE = np.dtype(np.float32)

_TINY = 1e-12
"""Entries of products of matrices below this are rounding."""


class ActionCodec:
    """Reads actions written in a representation.

    Parameters
    ----------
    core : EnvCore
    name : str
        The representation.
    """

    def __init__(self, core: EnvCore, name: str) -> None:
        self._core = core
        self.representation = representation = make_representation(name, core.robot)
        self.space = spaces.Box(-1.0, 1.0, (representation.size,), np.float32)
        onto = core.robot.encoder @ representation.decoder
        spans = np.abs(core.robot.decoder @ onto - representation.decoder).max() < _TINY
        square = onto.shape[0] == onto.shape[1]
        # No tendon has to be looked at where all actions lie on the manifold.
        self._on_manifold = bool(spans)
        self._same = bool(
            square and np.abs(onto - np.eye(len(onto))).max() < _TINY and not representation.polar
        )
        self._to_clarke = LinearMap(onto.T.copy())
        self._raw = name == "raw"
        self._plain = self._raw or self._same
        self._shape = core.single_or_batch(representation.size)
        self._one = len(self._shape) == 1

    def decode(self, action: ArrayLike) -> NDArray[np.float64]:
        """Return the joint-space action in float64, so that it is on the manifold to rounding."""
        array = np.asarray(action, dtype=np.float64)
        if array.ndim == 0 or array.shape[-1] != self._shape[-1]:
            self._refuse_shape(array)
        check_finite(array if array.ndim > 1 else array.tolist())
        return self.representation.decode(array)

    def read(self, action: ArrayLike) -> Reading:
        """Return the action as the core takes it.

        Parameters
        ----------
        action : array_like, shape (B, K), or (K,) in the scalar environment

        Raises
        ------
        ValueError
            If the action has another shape or is not finite.
        """
        array: NDArray[Any] = np.asarray(action)
        if array.shape != self._shape:
            self._refuse_shape(array)
        one = self._one
        if not (one and self._plain and array.dtype is _SINGLE):  # what needs no conversion
            array = array.astype(np.float64, copy=False)
        numbers: Any = array.tolist() if one else array
        if self._raw:
            return self._core.limits.read(numbers)
        check_finite(numbers)
        if self._same:
            return Reading(numbers if one else components(array, False))
        if not self._on_manifold:
            joint = self.representation.decode(array)
            return self._core.limits.read(joint.tolist() if one else joint)
        array = self.representation.linear(array)
        array = self._to_clarke.of_numbers(array) if one else self._to_clarke.of_rows(array)
        return Reading(array.tolist() if one else components(array, False))

    def _refuse_shape(self, array: NDArray[Any]) -> NoReturn:
        raise ValueError(
            f"action must have the shape {self._shape}, got {array.shape}, in the representation "
            f"{self.representation.name!r}"
        )


class ObservationCodec:
    """Writes observations in a representation; the task's part is the same in all.

    Parameters
    ----------
    core : EnvCore
    name : str
        The representation.
    """

    def __init__(self, core: EnvCore, name: str) -> None:
        robot, blocks = core.robot, len(JOINT_BLOCKS)
        self._core = core
        self.representation = representation = make_representation(name, robot)
        encoder = representation.encoder
        factor, off = core.joint_bounds()
        bound = np.tile(representation.encoded_bound(robot, factor, off), blocks)
        # The margin covers float32 rounding of the encoding itself.
        self._high = ((1.0 + 1e-6) * bound).astype(np.float32)
        self._width = blocks * representation.size
        # Displacements can pass the commands' limits for a moment.
        self._clips = core.physics.displacement_bound > 1.0
        self._least_bound = float(self._high.min())
        onto = encoder @ (robot.decoder / robot.joint_scale[:, None])
        self._tail = core.task_size()
        self._assemble = LinearMap(self._on_blocks(onto), columns=True)
        residual = encoder - encoder @ robot.decoder @ robot.encoder
        self._sees_off = bool(np.abs(residual).max() > _TINY)
        raw = np.array_equal(encoder, np.eye(len(encoder)))
        self._off_map = None if raw else encoder.T.copy()
        self._off_scale = (1.0 / robot.joint_scale).astype(np.float32)
        self._off_scales = self._off_scale.tolist() * blocks
        # Axes along those of the Clarke coordinates need no product at all.
        self._scales: list[float] | None = None
        if onto.shape[0] == onto.shape[1] and not (self._sees_off or representation.polar):
            diagonal = np.diag(onto)
            if np.abs(onto - np.diag(diagonal)).max() < _TINY * diagonal.max():
                self._scales = diagonal.tolist() * blocks

    def _on_blocks(self, matrix: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the map of rows that does the same to every joint block, nothing to the rest."""
        blocks = [matrix.T] * len(JOINT_BLOCKS)
        return block_diagonal([*blocks, np.eye(self._tail)]).astype(np.float32)

    @cached_property
    def _encode(self) -> LinearMap:
        """Maps observations that foreign layers have handled in joint space."""
        return LinearMap(self._on_blocks(self.representation.encoder))

    def space(self, like: spaces.Space[Any]) -> spaces.Space[Any]:
        """Return the space of one environment's observations, given that of another codec's."""
        inner = like["observation"] if isinstance(like, spaces.Dict) else like
        tail = inner.high[len(inner.high) - self._tail :]  # type: ignore[attr-defined]
        high = np.concatenate([self._high, tail])
        box = spaces.Box(-high, high, dtype=np.float32)
        if isinstance(like, spaces.Dict):
            return spaces.Dict({**like.spaces, "observation": box})
        return box

    def during(self, call: Callable[..., Any], *args: Any) -> Any:
        """Return what a call returns, with this codec in the place of the core's own."""
        core = self._core
        before = core.observer
        core.observer = self
        try:
            return call(*args)
        finally:
            core.observer = before

    def write(
        self, command: JointVector, displacement: JointVector, task: list[Number]
    ) -> NDArray[np.float32]:
        """Return observations as new arrays: a row for each environment, or one row.

        Parameters
        ----------
        command, displacement : JointVector
            [m].
        task : list
            The components of the task's part.
        """
        if isinstance(task[0], float):
            return self._row(command, displacement, task)
        parts = command.parts + displacement.parts
        rows: NDArray[np.float32]
        if self._scales is not None:
            rows = np.empty((len(task[0]), self._width + self._tail), np.float32)
            for k, (part, scale) in enumerate(zip(parts, self._scales, strict=True)):
                rows[:, k] = part * scale
            for k, part in enumerate(task, self._width):
                rows[:, k] = part
        else:
            rows = self._assemble.of_columns(parts + task)
        for block, off in enumerate((command.off_manifold, displacement.off_manifold)):
            if off is not None and self._sees_off:
                size = self.representation.size
                change = np.asarray(off) * self._off_scale
                if self._off_map is not None:
                    change = map_rows(change, self._off_map)
                rows[:, block * size : (block + 1) * size] += change
        self._finish(rows)
        return rows

    def _row(
        self, command: JointVector, displacement: JointVector, task: list[float]
    ) -> NDArray[np.float32]:
        """Return the scalar environment's observation."""
        parts = command.parts + displacement.parts
        if self._scales is not None:
            numbers = list(map(mul, parts, self._scales))
            row = np.array(numbers + task, _SINGLE)
            if max(numbers) > self._least_bound or min(numbers) < -self._least_bound:
                self._finish(row)
            return row
        row = self._assemble.of_numbers(parts + task).copy()
        offs: Any = (command.off_manifold, displacement.off_manifold)
        if self._sees_off and offs != (None, None):
            none = [0.0] * len(self._off_scale)
            off = list(map(mul, (offs[0] or none) + (offs[1] or none), self._off_scales))
            if self._off_map is not None:
                change = np.array(off).reshape(len(offs), -1)
                off = map_rows(change, self._off_map).ravel().tolist()
            joints = row[: self._width]
            joints[:] = list(map(add, joints.tolist(), off))
        self._finish(row)
        return row

    def _finish(self, rows: NDArray[np.float32]) -> None:
        joints = rows[..., : self._width]
        if self.representation.polar:
            to_polar(joints)
        if self._clips:
            np.minimum(np.maximum(joints, -self._high, out=joints), self._high, out=joints)

    def encode(self, observation: Any) -> Any:
        """Return an observation in joint space with its joint blocks encoded, as new arrays."""
        if isinstance(observation, dict):
            return {**observation, "observation": self._encoded(observation["observation"])}
        return self._encoded(observation)

    def _encoded(self, rows: NDArray[np.float32]) -> NDArray[np.float32]:
        coded: NDArray[np.float32]
        one = rows.ndim == 1
        coded = self._encode.of_numbers(rows).copy() if one else self._encode.of_rows(rows)
        self._finish(coded)
        return coded
