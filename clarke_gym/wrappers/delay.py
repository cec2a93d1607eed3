"""Actions that arrive late."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike, NDArray

from clarke_gym.numerics.checks import check_count
from clarke_gym.wrappers.codec import ActionCodec, face_of, representation_of, same_numbers
from clarke_gym.wrappers.goals import AsksRewards


class Line:
    """Actions on their way to B environments.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    space : gymnasium.spaces.Box
        Of one environment's actions.
    num_envs : int
    delay : int
        Control periods.

    Raises
    ------
    ValueError, TypeError
        If the delay is no number of control periods, actions are absolute, or a wrapper below has
        changed their bounds.
    """

    def __init__(self, env: Any, space: Any, num_envs: int, delay: int) -> None:
        check_count("delay", delay, 0)
        if face_of(env, "DelayedAction").control != "increment":
            raise ValueError(
                "DelayedAction needs control='increment', where drives can be told to wait; the "
                "disturbance 'command_delay' delays commands of any control"
            )
        representation = representation_of(env, ActionCodec)
        self._wait = representation.encode(np.zeros(representation.n_joints))
        if not same_numbers(space, spaces.Box(-1.0, 1.0, self._wait.shape, np.float32)):
            raise ValueError(
                f"DelayedAction needs actions from -1 to 1 of the shape {self._wait.shape}; a "
                f"wrapper below makes them {space!r}: put DelayedAction on first"
            )
        self._kept = np.empty((num_envs, delay + 1, *space.shape), np.float64)
        self.clear(slice(None))

    def clear(self, rows: Any) -> None:
        """Forget what is on its way."""
        self._kept[rows] = self._wait

    def passed(self, actions: ArrayLike) -> NDArray[np.float64]:
        """Return the actions that arrive while others set out, both (B, ...).

        Raises
        ------
        ValueError
            If actions have another shape or are not finite: late, nobody would know which.
        """
        given = np.asarray(actions, dtype=np.float64)
        expected = self._kept[:, 0].shape
        if given.shape != expected or not np.isfinite(given).all():
            raise ValueError(f"actions must be finite with the shape {expected}, got {actions!r}")
        self._kept = np.roll(self._kept, -1, axis=1)
        self._kept[:, -1] = given
        return self._kept[:, 0].copy()


class DelayedAction(AsksRewards, gym.ActionWrapper[Any, Any, Any], RecordConstructorArgs):
    """Act late: actions arrive some control periods after they were chosen.

    Until the first one arrives the drives wait. The disturbance "command_delay" draws its delay for
    every episode, inside `state()`; this one is the same for all.

    Parameters
    ----------
    env : gymnasium.Env
        A clarke_gym environment with ``control="increment"``.
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
    >>> env = gymnasium.make("clarke_gym/Reach-v0", representation="clarke")
    >>> late = DelayedAction(env, delay=2)
    >>> _ = late.reset(seed=1)
    >>> start = env.unwrapped.physics.state.displacement
    >>> moved = []
    >>> for _ in range(3):
    ...     _ = late.step(np.float32([1.0, 0.0]))
    ...     moved.append(bool((env.unwrapped.physics.state.displacement != start).any()))
    >>> moved
    [False, False, True]
    """

    def __init__(self, env: gym.Env[Any, Any], delay: int = 1) -> None:
        RecordConstructorArgs.__init__(self, delay=delay)
        gym.ActionWrapper.__init__(self, env)
        self._line = Line(env, env.action_space, 1, delay)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Reset, with nothing on its way."""
        self._line.clear(0)
        return super().reset(seed=seed, options=options)

    def action(self, action: ArrayLike) -> Any:
        """Return the action that arrives now."""
        return self._line.passed(np.asarray(action)[None])[0]
