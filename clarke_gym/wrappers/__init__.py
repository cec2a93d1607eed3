"""Wrappers of the scalar environment; their vector twins are in `clarke_gym.wrappers.vector`.

Late and stacked observations are `gymnasium.wrappers.DelayObservation` and `FrameStackObservation`,
which need nothing of their own here; they have no vector form there, so the twins are ours.
"""

from clarke_gym.wrappers.delay import DelayedAction
from clarke_gym.wrappers.noise import NoisyObservation
from clarke_gym.wrappers.representation import (
    ClarkeAction,
    ClarkeObservation,
    RepresentationAction,
    RepresentationObservation,
)

__all__ = [
    "ClarkeAction",
    "ClarkeObservation",
    "DelayedAction",
    "NoisyObservation",
    "RepresentationAction",
    "RepresentationObservation",
]
