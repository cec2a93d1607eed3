"""Vector twins of `clarke_gym.wrappers` and of Gymnasium's that have none, for every reset mode."""

from clarke_gym.wrappers.vector.delay import DelayedAction, DelayObservation
from clarke_gym.wrappers.vector.noise import NoisyObservation
from clarke_gym.wrappers.vector.representation import (
    ClarkeAction,
    ClarkeObservation,
    RepresentationAction,
    RepresentationObservation,
)
from clarke_gym.wrappers.vector.stack import FrameStackObservation

__all__ = [
    "ClarkeAction",
    "ClarkeObservation",
    "DelayObservation",
    "DelayedAction",
    "FrameStackObservation",
    "NoisyObservation",
    "RepresentationAction",
    "RepresentationObservation",
]
