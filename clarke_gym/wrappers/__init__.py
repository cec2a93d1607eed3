"""Wrappers of the scalar environment; their vector twins are in `clarke_gym.wrappers.vector`."""

from clarke_gym.wrappers.representation import (
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
