"""Disturbances: what reality does to the nominal robot."""

from clarke_gym.disturbances.backlash import Backlash
from clarke_gym.disturbances.base import DISTURBANCES, Disturbance, register_disturbance

__all__ = ["DISTURBANCES", "Backlash", "Disturbance", "register_disturbance"]
