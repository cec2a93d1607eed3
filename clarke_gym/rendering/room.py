"""Where pictures are drawn: the OpenGL context, the room around the robot."""

from __future__ import annotations

import importlib
import math
import os
from typing import Any

import mujoco

from clarke_gym.robots.robot import Robot

_BACKENDS = ("egl", "osmesa")
_process: int | None = None
"""The process whose first picture opened OpenGL; drivers hang in its forked children."""

_HELP = (
    "no OpenGL for off-screen rendering: install the Debian packages libegl1, libegl-mesa0 and "
    "libgl1-mesa-dri (EGL), or libosmesa6 (OSMesa); MUJOCO_GL=egl or osmesa chooses one"
)


def make_context(width: int, height: int) -> Any:
    """Return a current off-screen OpenGL context.

    Raises
    ------
    RuntimeError
        If neither EGL nor OSMesa works; the message names the packages.
    """
    global _process
    if _process is not None and _process != os.getpid():
        raise RuntimeError(
            "a process forked from one that has drawn cannot draw: start it with 'spawn' (in "
            "Gymnasium, AsyncVectorEnv(..., context='spawn')), or draw in one of the two alone"
        )
    chosen = os.environ.get("MUJOCO_GL", "").lower()
    problems = []
    for backend in (chosen,) if chosen in (*_BACKENDS, "glfw") else _BACKENDS:
        try:
            context = importlib.import_module(f"mujoco.{backend}").GLContext(width, height)
            context.make_current()
        except Exception as error:  # each backend fails in its own way
            problems.append(f"{backend}: {error}")
            os.environ.pop("PYOPENGL_PLATFORM", None)  # a failed backend must not bind the next
        else:
            _process = os.getpid()
            return context
    raise RuntimeError(f"{_HELP} ({'; '.join(problems)})")


def room(robot: Robot) -> tuple[float, float]:
    """Return the height of a floor below every tip, and how far tips get from the base's axis [m].

    A robot that can bend by T in all hangs lowest when it turns by half a turn first, and reaches
    out furthest when it turns by a quarter, as early as it can.
    """
    total = float(robot.max_bending.sum())
    hanging = max(0.0, 1.0 - math.pi / total)
    turning = min(1.0, 0.5 * math.pi / total)
    reach = turning * 2.0 / math.pi + 1.0 - turning
    return -max(0.1, hanging + 0.05) * robot.length_m, reach * robot.length_m


FIELD_OF_VIEW_DEG = 45.0
"""Vertical angle that the camera sees."""


def camera_distance(height: float, reach: float, aspect: float) -> float:
    """Return from how far away an arm fills the picture, however it bends [m].

    Parameters
    ----------
    height : float
        From the floor to the tip of the straight arm [m].
    reach : float
        How far tips get from the base's axis [m].
    aspect : float
        Width of the picture over its height.

    Returns
    -------
    float

    Examples
    --------
    >>> round(camera_distance(1.0, 0.5, 1.0), 2), round(camera_distance(1.0, 0.5, 0.5), 2)
    (1.45, 2.9)
    """
    half = max(0.5 * height, reach / aspect)
    return 1.2 * half / math.tan(math.radians(0.5 * FIELD_OF_VIEW_DEG))


def make_model(width: int, height: int, length: float, floor: float) -> mujoco.MjModel:
    """Return the empty room: floor, light and the quality settings that keep frames cheap."""
    spec = mujoco.MjSpec()
    spec.stat.extent = 2.0 * length
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.quality.offsamples = 4 if width * height > 200 * 200 else 0
    spec.visual.quality.numslices, spec.visual.quality.numstacks = 16, 8
    spec.visual.quality.numquads = 1
    spec.visual.global_.fovy = FIELD_OF_VIEW_DEG
    spec.visual.headlight.ambient = [0.5, 0.5, 0.5]
    spec.visual.headlight.diffuse = [0.45, 0.45, 0.45]
    spec.visual.headlight.specular = [0.1, 0.1, 0.1]
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.98, 0.98, 0.99],
        rgb2=[0.80, 0.86, 0.92],
        width=64,
        height=384,
    )
    square = 0.05 * 2 ** max(0, math.ceil(math.log2(length / 0.6)))
    spec.add_texture(
        name="squares",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.95, 0.96, 0.97],
        rgb2=[0.88, 0.90, 0.92],
        width=256,
        height=256,
    )
    floors = spec.add_material(
        name="squares", texuniform=True, texrepeat=[0.5 / square] * 2, emission=0.45, specular=0.0
    )
    textures = floors.textures
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "squares"
    floors.textures = textures
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[1.2 * length, 1.2 * length, 0.01],
        pos=[0.0, 0.0, floor],
        material="squares",
    )
    return spec.compile()
