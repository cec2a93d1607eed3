"""Classical controllers on the interface of a policy."""

from clarke_gym.control.controllers import (
    CONTROLLERS,
    Gains,
    ResolvedRateController,
    TipController,
    make_controller,
)

__all__ = [
    "CONTROLLERS",
    "Gains",
    "ResolvedRateController",
    "TipController",
    "make_controller",
]
