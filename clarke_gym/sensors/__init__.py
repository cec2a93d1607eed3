"""Sensors: what policies see, block by block."""

from clarke_gym.sensors import joint_space, task_space
from clarke_gym.sensors.base import (
    LADDER,
    ORACLE,
    SENSORS,
    JointSensor,
    Plant,
    Sensor,
    TaskSensor,
    register_sensor,
)

__all__ = [
    "LADDER",
    "ORACLE",
    "SENSORS",
    "JointSensor",
    "Plant",
    "Sensor",
    "TaskSensor",
    "joint_space",
    "register_sensor",
    "task_space",
]
