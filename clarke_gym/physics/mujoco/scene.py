"""Bodies of a scene in a MuJoCo model, and the sensor of their force on the robot."""

from __future__ import annotations

import mujoco
import numpy as np

from clarke_gym.robots.scene import Scene

SOLREF = (0.01, 1.0)
"""Time constant [s] and damping ratio of contacts: MuJoCo's default lets 1 to 3 mm in."""


def add_scene(spec: mujoco.MjSpec, scene: Scene) -> None:
    """Add the bodies of a scene, and a sensor of the net force between robot and scene.

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
    for k, body in enumerate(scene.bodies):
        start, end = np.array(body.start_m), np.array(body.end_m)
        shape = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "pos": start}
        if (start != end).any():
            shape = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "fromto": [*start, *end]}
        spec.worldbody.add_geom(
            name=f"scene{k}",
            size=[body.radius_m, 0.0, 0.0],
            contype=2,
            conaffinity=1,
            solref=SOLREF,
            **shape,
        )
    spec.add_sensor(
        name="contact",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_XBODY,
        objname="base",
        intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FORCE), 3, 1],
    )
