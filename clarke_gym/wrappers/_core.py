"""How a wrapper finds the core that it is for."""

from __future__ import annotations

from typing import Any

from gymnasium.wrappers import OrderEnforcing, TimeLimit

from clarke_gym.envs.core import EnvCore

_PASSIVE = (OrderEnforcing, TimeLimit)


def core_of(env: Any, wrapper: str) -> EnvCore:
    """Return the core under any wrappers, or say that this is not one of our environments."""
    core = getattr(env.unwrapped, "core", None)
    if not isinstance(core, EnvCore):
        raise TypeError(f"{wrapper} needs a clarke_gym environment, got {env!r}")
    return core


def hands_through(env: Any, *others: type) -> bool:
    """Return whether no layer looks at actions or observations on their way to the core.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
    *others : type
        Wrappers that do not, beside Gymnasium's own in the stack of `gymnasium.make`.

    Returns
    -------
    bool

    Examples
    --------
    >>> import gymnasium, clarke_gym
    >>> env = gymnasium.make("clarke_gym/Reach-v0")
    >>> hands_through(env), hands_through(gymnasium.wrappers.ClipAction(env))
    (True, False)
    """
    while env is not env.unwrapped:
        # Subclasses may do more.
        if type(env) not in (*_PASSIVE, *others):
            return False
        env = env.env
    return True
