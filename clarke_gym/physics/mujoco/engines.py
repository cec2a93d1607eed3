"""Which engine steps a batch."""

from __future__ import annotations

from clarke_gym.numerics.batch import Batch, One
from clarke_gym.physics.mujoco.batch_engine import BatchEngine
from clarke_gym.physics.mujoco.engine import Engine
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.single_engine import SingleEngine


def make_engine(chain: Chain, batch: Batch, threads: int, poses: bool) -> Engine:
    """Return what steps a robot by itself, or many on some threads.

    Parameters
    ----------
    chain : Chain
    batch : Batch
    threads : int
    poses : bool
        Whether every step computes where the bodies are afterwards.

    Returns
    -------
    Engine

    Examples
    --------
    >>> from clarke_gym.physics.mujoco.model import PROFILES, build_chain
    >>> from clarke_gym.robots import Robot
    >>> type(make_engine(build_chain(Robot(), PROFILES["fast"]), One(), 1, True)).__name__
    'SingleEngine'
    """
    if isinstance(batch, One):
        return SingleEngine(chain)
    return BatchEngine(chain, batch.size, threads, poses)
