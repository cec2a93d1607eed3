"""clarke_gym: continuum robots in raw tendon space or Clarke coordinates.

Importing the package registers its environments with Gymnasium:

>>> import gymnasium as gym, clarke_gym
>>> env = gym.make("clarke_gym/Reach-v0", n_tendons=7, representation="clarke")
>>> env.action_space
Box(-1.0, 1.0, (2,), float32)
"""

from clarke_gym import _paths_of_0_1
from clarke_gym.registration import register_environments
from clarke_gym.wrappers import (
    ClarkeAction,
    ClarkeObservation,
    RepresentationAction,
    RepresentationObservation,
)

__version__ = "0.1.0"

__all__ = [
    "ClarkeAction",
    "ClarkeObservation",
    "RepresentationAction",
    "RepresentationObservation",
    "__version__",
]

_paths_of_0_1.keep()
register_environments()
