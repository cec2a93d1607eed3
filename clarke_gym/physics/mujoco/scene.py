"""Bodies of a scene in a MuJoCo model, and the sensor of their force on the robot."""

from __future__ import annotations

import mujoco
import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.robots.scene import Scene

SOLREF = (5e-3, 1.0)
"""Time constant [s] and damping ratio of contacts: MuJoCo's default lets 1 to 3 mm in."""

SOLIMP = (0.9, 0.99, 1e-3, 0.5, 2.0)
"""Impedance of contacts: stiff tendons push through MuJoCo's default, but nearer to 1 at the first
touch impacts at full speed go deeper."""

CONTACT_DT_S = 2.5e-3
"""Longest time step [s] among bodies: at 5 ms full-speed impacts go 11 mm deep."""


def add_scene(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the bodies of a scene, and a sensor of the net force between robot and scene.

    Bodies that every episode places anew are mocap bodies, whose poses belong to a simulation's
    data, not to the model.

    Parameters
    ----------
    spec : mujoco.MjSpec
        Of a robot in the frame of its base, whose hull is there.
    scene : Scene

    Examples
    --------
    >>> from clarke_gym.robots.scene import Capsule
    >>> spec = mujoco.MjSpec()
    >>> _ = spec.worldbody.add_body(name="base")
    >>> add_scene(spec, Scene((Capsule((0.1, 0.0, 0.0), (0.1, 0.0, 0.0), 0.02),)))
    >>> len(spec.geoms), len(spec.sensors)
    (1, 1)
    """
    for k, (body, numbers) in enumerate(zip(scene.bodies, scene.numbers, strict=True)):
        position, quaternion, half = (part[0] for part in poses(numbers[None]))
        owner = spec.worldbody
        if scene.placed:
            owner = owner.add_body(name=f"scene{k}", pos=position, quat=quaternion, mocap=True)
            position, quaternion = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        kind = "mjGEOM_SPHERE" if body.is_sphere else "mjGEOM_CAPSULE"
        owner.add_geom(
            name=f"scene{k}",
            type=getattr(mujoco.mjtGeom, kind),
            pos=position,
            quat=quaternion,
            size=[body.radius_m, half, 0.0],
            contype=2,
            conaffinity=1,
            priority=1,  # else MuJoCo takes the mean with the hull's defaults
            solref=SOLREF,
            solimp=SOLIMP,
        )
    spec.add_sensor(
        name="contact",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_XBODY,
        objname="base",
        intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE), 3, 1],
    )


def poses(numbers: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where capsules are.

    Parameters
    ----------
    numbers : ndarray, shape (..., 7)
        Ends of each axis and radius [m].

    Returns
    -------
    position : ndarray, shape (..., 3)
        Middles [m].
    quaternion : ndarray, shape (..., 4)
        Least turns (w, x, y, z) that take the z axis to theirs.
    half : ndarray, shape (...)
        Half of each axis [m].

    Examples
    --------
    >>> poses(np.array([[-1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.1]]))[1].round(3) + 0.0
    array([[0.707, 0.   , 0.707, 0.   ]])
    """
    start, end = numbers[..., :3], numbers[..., 3:6]
    axis = 0.5 * (end - start)
    half = np.sqrt(np.vecdot(axis, axis))
    x, y, z = np.moveaxis(axis / np.where(half > 0.0, half, 1.0)[..., None], -1, 0)
    # A capsule is its own mirror image: pointing up it needs no half turn.
    sign = np.where(z < 0.0, -1.0, 1.0)
    turn = np.stack([1.0 + sign * z, -sign * y, sign * x, np.zeros_like(z)], -1)
    length: FloatArray = np.linalg.norm(turn, axis=-1, keepdims=True)
    return 0.5 * (start + end), turn / length, half
