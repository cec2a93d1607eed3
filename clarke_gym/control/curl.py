"""Curling round a cylinder: the classical reference of Wrap."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym.control.manifold_interface import JointInterface
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import hull_radius
from clarke_gym.robots import Robot
from clarke_gym.tasks import Wrap

TIGHTER = 1.5
"""Bend that is asked for, over that of a backbone which lies on the cylinder: what presses it on,
and what is left when the tip is pulled."""


def curl(robot: Robot, bodies: FloatArray) -> FloatArray:
    """Return the bends that lay straight robots round the cylinders beside them.

    What is above a cylinder's axis follows the circle of the cylinder's radius and the hull's. A
    segment that passes the axis is bent evenly all the same, so it begins to bend below: the
    cylinder holds it off.

    Parameters
    ----------
    robot : Robot
    bodies : ndarray, shape (B, 7)
        Ends of each cylinder's axis and radius [m].

    Returns
    -------
    ndarray, shape (B, S, 2)
        Bending vectors [rad], towards the axis, within the robot's limits.

    Examples
    --------
    >>> bar = np.array([[0.15, -0.1, 0.1, 0.15, 0.1, 0.1, 0.12 - hull_radius(Robot())]])
    >>> curl(Robot(), bar)[0].round(6)
    array([[1.25, 0.  ]])
    """
    middle = 0.5 * (bodies[:, :3] + bodies[:, 3:6])
    towards = middle[:, :2] / np.hypot(middle[:, 0], middle[:, 1])[:, None]
    above = np.cumsum(robot.lengths) - middle[:, 2:]
    along = np.minimum(np.maximum(above, 0.0), robot.lengths)
    angle = TIGHTER * along / (bodies[:, 6:] + hull_radius(robot))
    bending: FloatArray = np.minimum(angle, robot.max_bending)[..., None] * towards[:, None]
    return bending


class CurlController:
    """Winds a robot round the cylinder beside it: feed-forward, and then held.

    The bends follow from the cylinder's place and radius, as a camera would tell them; drives go
    there at their speed limit. What is bent more than the cylinder lets it presses the robot on.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment of the task Wrap.

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its task is another one.
    """

    def __init__(self, env: Any) -> None:
        self._interface = JointInterface(env)
        if not isinstance(self._interface.task, Wrap):
            raise ValueError(
                f"curling needs a cylinder to wind round; {type(self._interface.task).__name__} "
                "has none"
            )

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions (B, k) for a batch of observations, or (k,) for a single one."""
        interface = self._interface
        bending = curl(interface.robot, interface.bodies[:, 0])
        target = kinematics.bending_to_clarke(bending, interface.robot.pitch_radii)
        action = interface.act(target, interface.joints(observation)["command"])
        return interface.answer(observation, action)
