"""Frozen, validated descriptions of robots, and robots with published dimensions by name."""

from clarke_gym.robots.description import robot_from_dict, robot_from_yaml
from clarke_gym.robots.materials import (
    MATERIALS,
    Material,
)
from clarke_gym.robots.presets import (
    HOLDING_LENGTH_M,
    PRESETS,
    ROBOTS,
    make_robot,
    register_robot,
)
from clarke_gym.robots.robot import (
    JOINT_TYPES,
    Robot,
    Segment,
)

__all__ = [
    "HOLDING_LENGTH_M",
    "JOINT_TYPES",
    "MATERIALS",
    "PRESETS",
    "ROBOTS",
    "Material",
    "Robot",
    "Segment",
    "make_robot",
    "register_robot",
    "robot_from_dict",
    "robot_from_yaml",
]
