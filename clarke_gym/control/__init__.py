"""Classical controllers on the interface of a policy."""

from clarke_gym.control.controllers import (
    CONTROLLERS,
    Gains,
    ResolvedRateController,
    TipController,
    make_controller,
)
from clarke_gym.control.mppi import MppiController, MppiSettings

__all__ = [
    "CONTROLLERS",
    "Gains",
    "MppiController",
    "MppiSettings",
    "ResolvedRateController",
    "TipController",
    "make_controller",
]
