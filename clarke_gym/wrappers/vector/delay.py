"""Vector twins of delays, of actions and of observations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.checks import check_count
from clarke_gym.wrappers.delay import Line
from clarke_gym.wrappers.vector.layer import EpisodeLayer, ObservationLayer, VectorEnv


class DelayedAction(EpisodeLayer):
    """Act late: actions arrive some control periods after they were chosen.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
        A clarke_gym vector environment with ``control="increment"``.
    delay : int
        Control periods, 0 or more.

    Raises
    ------
    ValueError, TypeError
        If the delay is no number of control periods, actions are absolute, or `env` is another
        environment.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> envs = gymnasium.make_vec("clarke_gym/Reach-v0", num_envs=2, representation="clarke")
    >>> late = DelayedAction(envs, delay=1)
    >>> _ = late.reset(seed=1)
    >>> start = envs.unwrapped.physics.state.displacement
    >>> _ = late.step(np.ones((2, 2), np.float32))
    >>> bool((envs.unwrapped.physics.state.displacement == start).all())
    True
    """

    def __init__(self, env: VectorEnv, delay: int = 1) -> None:
        super().__init__(env)
        self._line = Line(env, env.single_action_space, self.num_envs, delay)

    def forget(self, rows: NDArray[np.bool_], seed: Any = None) -> None:
        """Begin episodes with nothing on its way."""
        del seed
        self._line.clear(rows)

    def sent(self, actions: Any) -> Any:
        """Return the actions that arrive now."""
        arrived = self._line.passed(actions)
        # An action that Gymnasium ignores, because its episode begins with it, goes nowhere.
        self._line.clear(self._ended)
        return arrived


class DelayObservation(ObservationLayer):
    """Observe late: the twin of `gymnasium.wrappers.DelayObservation`, zeros before the first.

    Parameters
    ----------
    env : gymnasium.vector.VectorEnv
    delay : int
        Control periods, 0 or more.

    Raises
    ------
    ValueError
        If the delay is no number of control periods.

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> envs = gymnasium.make_vec("clarke_gym/Reach-v0", num_envs=2)
    >>> late = DelayObservation(envs, delay=1)
    >>> bool(late.reset(seed=1)[0].any())
    False
    """

    def __init__(self, env: VectorEnv, delay: int) -> None:
        super().__init__(env, check_count("delay", delay, 0) + 1)

    def before(self, first: NDArray[Any]) -> NDArray[Any]:
        """Return zeros."""
        return np.zeros_like(first)

    def shown(self, ring: NDArray[Any]) -> NDArray[Any]:
        """Return the oldest observation."""
        return ring[:, 0].copy()
