"""What moves the robot: one protocol, several models by name."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterator
from typing import Any

from clarke_gym.numerics.registry import Registry

_METHODS = (
    *("rest", "reset", "step", "place", "pull", "vary", "backbone"),
    *("get_state", "set_state"),
)

_PLACE = re.compile(r"[\w.]+:\w+")

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
    TypeError
        If what a text names is no model.

    Examples
    --------
    >>> physics_class("constant_curvature").__name__
    'ConstantCurvature'
    """
    entry = PHYSICS[name]
    if isinstance(entry, str):
        module, member = entry.split(":")
        entry = getattr(importlib.import_module(module), member)
        _check_model(name, entry)
    return entry


def _check_model(name: str, model: Any) -> None:
    """Refuse what cannot be a physics model.

    Raises
    ------
    TypeError
        With what it lacks.
    """
    wanted = f"physics {name!r} must be a class as clarke_gym.physics.base.Physics says"
    if not isinstance(model, type):
        raise TypeError(f"{wanted}, or 'module:Class'; got {model!r}")
    # One that hands on what another has may have any method.
    methods = () if hasattr(model, "__getattr__") else _METHODS
    lacking = [member for member in ("KEYWORDS", "OFFERS", *methods) if not hasattr(model, member)]
    if lacking:
        raise TypeError(f"{wanted}; {model.__name__} lacks {lacking}")


def loadable() -> Iterator[tuple[str, Any]]:
    """Yield the models that can be loaded, by name: somebody's that cannot spoils no message.

    Returns
    -------
    iterator of (str, type)

    Examples
    --------
    >>> [name for name, _ in loadable()][:2]
    ['constant_curvature', 'mujoco']
    """
    for name in PHYSICS.names():
        try:
            model = physics_class(name)
        except (ImportError, AttributeError, TypeError):
            continue
        yield name, model


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
    TypeError
        If `model` is neither; a text is looked up where it is first needed.

    Examples
    --------
    >>> register_physics("arcs_doctest", physics_class("constant_curvature"))
    """
    if isinstance(model, str):
        if not _PLACE.fullmatch(model):
            raise TypeError(f"physics {name!r} is named by a text 'module:Class', got {model!r}")
    else:
        _check_model(name, model)
    PHYSICS.register(name, model)
