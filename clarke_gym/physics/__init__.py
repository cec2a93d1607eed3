"""What moves the robot: one protocol, several models by name."""

from __future__ import annotations

import importlib
from typing import Any

from clarke_gym.numerics.registry import Registry

PHYSICS: Registry[Any] = Registry("physics")
"""Models by name: classes as `clarke_gym.physics.base.Physics` says, or "module:Class"."""

PHYSICS.register("constant_curvature", "clarke_gym.physics.constant_curvature:ConstantCurvature")
PHYSICS.register("mujoco", "clarke_gym.physics.mujoco:MujocoPhysics")


def physics_class(name: str) -> Any:
    """Return a model's class; "mujoco" loads the simulator.

    Parameters
    ----------
    name : str
        A name of `PHYSICS`.

    Returns
    -------
    type

    Raises
    ------
    ValueError
        If there is no model of that name.

    Examples
    --------
    >>> physics_class("constant_curvature").__name__
    'ConstantCurvature'
    """
    entry = PHYSICS[name]
    if isinstance(entry, str):
        module, member = entry.split(":")
        entry = getattr(importlib.import_module(module), member)
    return entry


def register_physics(name: str, model: Any) -> None:
    """Make a physics model available as ``physics=name``.

    Parameters
    ----------
    name : str
        A word of letters, digits and "_".
    model : type or str
        A class that fulfils `clarke_gym.physics.base.Physics` and is made from (robot, batch,
        control_dt, scene=...) and the keyword arguments in its ``KEYWORDS``; or "module:Class".

    Raises
    ------
    ValueError
        If the name is taken.

    Examples
    --------
    >>> register_physics("arcs_doctest", physics_class("constant_curvature"))
    """
    PHYSICS.register(name, model)
