"""Vector twins of `clarke_gym.wrappers`, in every autoreset mode."""

from clarke_gym.wrappers.vector.representation import (
    ClarkeAction,
    ClarkeObservation,
    RepresentationAction,
    RepresentationObservation,
)

__all__ = [
    "ClarkeAction",
    "ClarkeObservation",
    "RepresentationAction",
    "RepresentationObservation",
]
