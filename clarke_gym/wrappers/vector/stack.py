"""Vector twin of stacked observations."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from clarke_gym.numerics.checks import check_choice, check_count
from clarke_gym.wrappers.vector.layer import ObservationLayer, VectorEnv

PADDINGS = ("reset", "zero")


class FrameStackObservation(ObservationLayer):
    """Observe the last few observations: the twin of `gymnasium.wrappers.FrameStackObservation`.

    The sensor "command" is the sum of all actions, so a stack of it is a history of actions, too.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
    stack_size : int
        Observations, at least 1.
    padding_type : {"reset", "zero"}
        What stands for observations before the first of an episode: the first one, or zeros.

    Raises
    ------
    ValueError, TypeError
        If an argument is impossible.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> envs = gymnasium.make_vec("clarke_gym/Reach-v0", num_envs=2, representation="clarke")
    >>> FrameStackObservation(envs, 3).reset(seed=1)[0].shape
    (2, 3, 13)
    """

    def __init__(self, env: VectorEnv, stack_size: int, *, padding_type: str = "reset") -> None:
        super().__init__(env, check_count("stack_size", stack_size))
        self._zero = check_choice("padding_type", padding_type, PADDINGS) == "zero"
        self.shows(batch_space(env.single_observation_space, stack_size))

    def before(self, first: NDArray[Any]) -> NDArray[Any]:
        """Return the first observations, or zeros."""
        return np.zeros_like(first) if self._zero else first

    def shown(self, ring: NDArray[Any]) -> NDArray[Any]:
        """Return all that are kept."""
        return ring.copy()
