"""Model-predictive path integral control: plans by sampling on constant curvature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym.control.manifold_interface import JointInterface
from clarke_gym.envs.imagination import Imagination
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.checks import check_count, check_not_negative, check_positive
from clarke_gym.wrappers.codec import ActionCodec, codec_of


@dataclass(frozen=True)
class MppiSettings:
    """How plans are sampled.

    Parameters
    ----------
    samples : int
        Sequences of actions a step.
    horizon : int
        Control periods that they look ahead.
    hold : int
        Control periods for which a sampled change of action holds.
    noise : float
        Standard deviation of changes of an action.
    temperature : float
        Over the spread of returns: how much better sequences must be to count more.
    last : float
        Weight of the last reward: where a plan leads counts beside the way there.

    Raises
    ------
    ValueError
        If a count is no whole number above 0, `noise` or `temperature` is not positive and finite,
        or `last` is negative or not finite.
    """

    samples: int = 256
    horizon: int = 15
    hold: int = 3
    noise: float = 0.6
    temperature: float = 0.15
    last: float = 5.0

    def __post_init__(self) -> None:
        for name in ("samples", "horizon", "hold"):
            check_count(name, getattr(self, name))
        for name in ("noise", "temperature"):
            check_positive(name, getattr(self, name))
        check_not_negative("last", self.last)


class MppiController:
    r"""Samples sequences of actions around the last plan, and averages them by their returns.

    With the return R of each sequence :math:`u + \epsilon` on constant curvature, the plan becomes
    :math:`\sum w(u+\epsilon)` with :math:`w \propto \exp((R - \max R)/\lambda)`. Its first action
    is applied, the rest is where the next step begins. Half of the sequences carry a quarter of the
    noise, so that plans both look around and settle. Actions are sampled in the environment's own
    representation, so representations can be compared by what planning needs.

    The planner knows the episode (goal, path, bodies); disturbances are hidden from it.

    Source: Williams, Aldrich, Theodorou, "Model Predictive Path Integral Control: From Theory to
    Parallel Computation", J. Guid. Control Dyn. 40(2), 2017.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment made with keywords, whose task constant curvature can have.
    settings : MppiSettings, optional
    seed : int

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its task needs what constant curvature does not have.

    Examples
    --------
    >>> import gymnasium as gym, clarke_gym
    >>> env = gym.make("clarke_gym/Reach-v0", n_tendons=5, representation="clarke")
    >>> observation, _ = env.reset(seed=0)
    >>> MppiController(env, MppiSettings(samples=16)).act(observation).shape
    (2,)
    """

    def __init__(self, env: Any, settings: MppiSettings | None = None, seed: int = 0) -> None:
        self._settings = MppiSettings() if settings is None else settings
        self._interface = JointInterface(env)
        self._face = env.unwrapped
        if codec_of(env, ActionCodec) is not None:
            raise ValueError(
                "mppi plans in the representation that the environment was made with; make it with "
                "representation=... instead of a wrapper around its actions"
            )
        self._imagined = Imagination(self._face.config, self._settings.samples)
        self._seed = seed
        self.reset()

    def reset(self) -> None:
        """Forget all plans."""
        self._plans: list[FloatArray] = []
        self._steps: NDArray[np.int64] | None = None
        self._rng = np.random.default_rng(self._seed)

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions (B, k) for a batch of observations, or (k,) for a single one."""
        now, steps = self._interface.joints(observation), self._face.steps
        parameters, bodies = self._face.parameters, self._interface.bodies
        size, horizon = self._imagined.action_size, self._settings.horizon
        fresh = np.ones(len(steps), bool) if self._steps is None else steps <= self._steps
        self._steps = steps
        if len(self._plans) != len(steps):
            self._plans = [np.zeros((horizon, size)) for _ in steps]
        actions = np.empty((len(steps), size), np.float32)
        for row in range(len(steps)):
            plan = np.zeros((horizon, size)) if fresh[row] else self._plans[row]
            self._imagined.begin(
                parameters[row],
                int(steps[row]),
                now["command"][row],
                now["displacement"][row],
                bodies=bodies[row],
                difficulty=self._face.difficulty,
            )
            plan = self._improved(plan)
            actions[row] = plan[0]
            self._plans[row] = np.concatenate([plan[1:], plan[-1:]])
        return self._interface.answer(observation, actions)

    def _improved(self, plan: FloatArray) -> FloatArray:
        """Return a plan (H, K) made better by samples."""
        settings, (horizon, size) = self._settings, plan.shape
        knots = -(-horizon // settings.hold)
        noise = settings.noise * self._rng.standard_normal((knots, settings.samples, size))
        noise[:, : settings.samples // 2] *= 0.25
        noise[:, 0] = 0.0  # the plan itself
        changes = np.repeat(noise, settings.hold, axis=0)[:horizon]
        tried = np.clip(plan[:, None] + changes, -1.0, 1.0)
        returns = self._imagined.returns(tried, settings.last)
        scale = settings.temperature * max(float(returns.std()), 1e-9)
        weights = np.exp((returns - returns.max()) / scale)
        better: FloatArray = np.einsum("s,hsk->hk", weights / weights.sum(), tried)
        return better
