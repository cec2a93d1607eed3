"""clarke_gym: continuum robots in raw tendon space or Clarke coordinates.

Importing the package registers its environments with Gymnasium:

>>> import gymnasium as gym, clarke_gym
>>> env = gym.make("clarke_gym/Reach-v0", n_tendons=7, representation="clarke")
>>> env.action_space
Box(-1.0, 1.0, (2,), float32)

What users add is registered by name, also from outside the package: see `register_task`,
`register_sensor`, `register_disturbance`, `register_representation`, `register_robot` and
`register_physics`.
"""

from clarke_gym import _paths_of_0_1
from clarke_gym.disturbances import Disturbance, register_disturbance
from clarke_gym.physics import register_physics
from clarke_gym.physics.mjcf import export_mjcf
from clarke_gym.registration import register_environments
from clarke_gym.representations import register_representation
from clarke_gym.robots import Robot, Segment, register_robot
from clarke_gym.sensors import JointSensor, TaskSensor, register_sensor
from clarke_gym.tasks import Goal, GoalTask, Metric, Outcome, Task, register_task
from clarke_gym.wrappers import (
    ClarkeAction,
    ClarkeObservation,
    RepresentationAction,
    RepresentationObservation,
)

__version__ = "0.1.0"

__all__ = [
    "ClarkeAction",
    "ClarkeObservation",
    "Disturbance",
    "Goal",
    "GoalTask",
    "JointSensor",
    "Metric",
    "Outcome",
    "RepresentationAction",
    "RepresentationObservation",
    "Robot",
    "Segment",
    "Task",
    "TaskSensor",
    "__version__",
    "export_mjcf",
    "register_disturbance",
    "register_physics",
    "register_representation",
    "register_robot",
    "register_sensor",
    "register_task",
]

_paths_of_0_1.keep()
register_environments()
