"""Disturbances: what reality does to the nominal robot."""

from clarke_gym.disturbances import body, drives, sensing, springs, tendons  # noqa: F401  (they register)
from clarke_gym.disturbances.base import DISTURBANCES, Disturbance, register_disturbance
from clarke_gym.disturbances.presets import PRESETS, make_disturbances, parse

__all__ = [
    "DISTURBANCES",
    "PRESETS",
    "Disturbance",
    "make_disturbances",
    "parse",
    "register_disturbance",
]
