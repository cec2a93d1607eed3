"""Numbers of MuJoCo's model of which every robot of a batch may have its own."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from clarke_gym.kinematics import rotate
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import DISK_RIM_M
from clarke_gym.physics.mujoco.engine import Engine


class OwnFields:
    """What robots have of their own, by the fields of MuJoCo's model.

    Parameters
    ----------
    model : mujoco.MjModel
        The robot that all are by themselves.
    size : int
        Robots B.
    """

    def __init__(self, model: mujoco.MjModel, size: int) -> None:
        self._model, self._size = model, size
        self._own: dict[str, FloatArray] = {}

    @cached_property
    def _nominal(self) -> dict[str, FloatArray]:
        """Fields of the model before anything was varied."""
        fields = ("body_mass", "body_inertia", "jnt_stiffness", "dof_damping")
        return {
            **{field: getattr(self._model, field).copy() for field in fields},
            "opt.gravity": self._model.opt.gravity.copy(),
        }

    def vary(self, rows: NDArray[np.intp], name: str, values: FloatArray) -> None:
        """Give the robots `rows` numbers of their own, by a name of `Physics.vary`.

        Raises
        ------
        ValueError
            If the name is none of these.
        """
        for field, part in self._meant(name, values):
            if field not in self._own:
                self._own[field] = self.of(field, np.arange(self._size))
            self._own[field][rows] = part

    def varied(self, field: str) -> bool:
        """Return whether robots have numbers of their own in a field."""
        return field in self._own

    def of(self, field: str, rows: NDArray[np.intp]) -> FloatArray:
        """Return what the robots `rows` have in a field, (R, ...)."""
        if field in self._own:
            return self._own[field][rows]
        nominal = self._nominal[field]
        return np.broadcast_to(nominal, (len(rows), *nominal.shape)).copy()

    def give(self, engine: Engine) -> None:
        """Give simulations what their robots have of their own."""
        for field, own in self._own.items():
            engine.model_field(field)[:] = own

    def _meant(self, name: str, values: FloatArray) -> Iterator[tuple[str, FloatArray]]:
        """Yield a field and what it becomes (R, ...)."""
        nominal = self._nominal
        if name == "payload_kg":
            masses = np.tile(nominal["body_mass"], (len(values), 1))
            inertias = np.tile(nominal["body_inertia"], (len(values), 1, 1))
            tip = int(self._model.site("tip").bodyid[0])
            masses[:, tip] += values
            inertias[:, tip] += 0.4 * values[:, None] * DISK_RIM_M**2
            yield "body_mass", masses
            yield "body_inertia", inertias
        elif name in ("stiffness", "damping"):
            field = {"stiffness": "jnt_stiffness", "damping": "dof_damping"}[name]
            whole = nominal[field]
            yield field, whole * values.reshape(-1, *(1,) * whole.ndim)
        elif name == "base_tilt_rad":
            angle = np.linalg.norm(values, axis=1, keepdims=True)
            axis = values / np.where(angle > 0.0, angle, 1.0)
            back = np.hstack([np.cos(0.5 * angle), -np.sin(0.5 * angle) * axis])
            yield "opt.gravity", rotate(back, nominal["opt.gravity"])
        else:
            raise ValueError(f"physics cannot vary {name!r}")
