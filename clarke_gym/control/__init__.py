"""Classical controllers on the interface of a policy, and trained policies with NumPy alone."""

from clarke_gym.control.controllers import (
    CONTROLLERS,
    Gains,
    ResolvedRateController,
    TipController,
    make_controller,
)
from clarke_gym.control.curl import CurlController
from clarke_gym.control.mppi import MppiController, MppiSettings
from clarke_gym.control.network import NetworkPolicy, load_policy

__all__ = [
    "CONTROLLERS",
    "CurlController",
    "Gains",
    "MppiController",
    "MppiSettings",
    "NetworkPolicy",
    "ResolvedRateController",
    "TipController",
    "load_policy",
    "make_controller",
]
