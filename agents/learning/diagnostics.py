"""What happened inside a run, one row an update: ``diagnostics.npz``.

Lengths of actions are root mean squares in Clarke coordinates: *on* the manifold the length of
``M a``, *off* it that of the rest, times sqrt(2 / n), so that isotropic noise of one tendon counts
alike on both sides. Nothing here draws a random number or changes a model.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy

from clarke_gym.integrations.sb3 import Sb3VecEnv
from clarke_gym.numerics.arrays import FloatArray

FILE = "diagnostics.npz"

OF_STEPS = ("command_off", "capped", "slack")
"""Commands off the manifold over the co-contraction limit, share of them there, and of steps with a
slack tendon."""

AT_CAP = 0.999
"""From this on a command is held at the co-contraction limit: it was asked to go further."""

_PREFIX = "train/"

Rows = dict[str, list[Any]]
"""Name -> one number, or list of numbers, for each row."""


class Diagnostics:
    """Collects the rows of one run.

    Parameters
    ----------
    model : BaseAlgorithm
    vec_env : Sb3VecEnv
        The training environments.
    rows : dict
        What an interrupted run had collected; rows are added to it.
    """

    def __init__(self, model: BaseAlgorithm, vec_env: Sb3VecEnv, rows: Rows) -> None:
        self.rows = rows
        self._model = model
        env: Any = vec_env.env.unwrapped
        self._physics, self._cap = env.physics, env.robot.max_cocontraction_m
        self._representation, robot = env.action_representation, env.robot
        self._segments, self._increments = robot.n_segments, env.control == "increment"
        decoder = self._representation.decoder
        self._onto = robot.encoder @ decoder
        off = decoder - robot.decoder @ self._onto
        self._off = off * np.sqrt(2.0 / np.repeat(robot.n_tendons, robot.n_tendons))[:, None]
        self._along = np.linalg.pinv(self._onto) @ self._onto  # the directions that matter
        self._of_steps: list[list[float]] = []
        self._of_rollout: dict[str, float] = {}

    def after_step(self) -> None:
        """Look at what the drives are told: how far off the manifold, and what that slackens."""
        if not isinstance(self._model, OnPolicyAlgorithm):
            return  # their rows are no unit of their checkpoints: what is summed would be lost
        state = self._physics.state
        off = state.command_vector.off_manifold  # (N, B); None where nothing can leave it
        most = np.zeros(1) if off is None else np.abs(off).max(axis=0) / self._cap
        seen = [float(most.mean()), float((most > AT_CAP).mean())]
        if "tension" in self._physics.OFFERS:
            seen.append(float((state.tension <= 0.0).any(axis=1).mean()))
        self._of_steps.append(seen)

    def after_rollout(self) -> None:
        """Look at what was collected for the next update: actions, their means, their noise."""
        model = self._model
        means_of_steps = np.mean(self._of_steps, axis=0).tolist() if self._of_steps else []
        self._of_rollout = dict(zip(OF_STEPS, means_of_steps, strict=False))
        self._of_steps = []
        if not isinstance(model, OnPolicyAlgorithm) or self._representation.polar:
            return
        buffer, policy = model.rollout_buffer, model.policy
        actions = buffer.actions.reshape(-1, self._onto.shape[1]).astype(np.float64)
        means = _means(policy, buffer.observations)
        noise = actions - means
        taken = np.clip(actions, -1.0, 1.0)
        reached = (taken @ self._onto.T).reshape(-1, self._segments, 2)
        self._of_rollout |= {
            "mean_on": _length(means @ self._onto.T),
            "mean_off": _length(means @ self._off.T),
            "noise_on": _length(noise @ self._onto.T),
            "noise_off": _length(noise @ self._off.T),
            "outside_box": float((np.abs(actions) > 1.0).mean()),
        }
        if self._increments:  # an action of length 1 is the speed limit
            beyond = np.linalg.norm(reached, axis=2) > 1.0
            self._of_rollout["saturated"] = float(beyond.mean())

    def after_update(self) -> None:
        """Add a row, once for each update; call it before the logger forgets what it holds."""
        model = self._model
        steps = model.num_timesteps
        if not steps or (self.rows and self.rows["env_steps"][-1] == steps):
            return
        row: dict[str, Any] = {"env_steps": steps}
        row |= {
            name.removeprefix(_PREFIX): float(value)
            for name, value in model.logger.name_to_value.items()
            if name.startswith(_PREFIX)
        }
        row |= self._of_rollout | self._of_policy()
        before = len(self.rows.get("env_steps", []))
        for name in {*self.rows, *row}:  # off-policy algorithms say nothing before they learn
            values = self.rows.setdefault(name, [float("nan")] * before)
            values.append(row.get(name, float("nan")))

    def _of_policy(self) -> dict[str, Any]:
        """Return noise by coordinate, and gradients of the last minibatch as they were applied."""
        policy = self._model.policy
        if not isinstance(policy, ActorCriticPolicy) or not hasattr(policy, "log_std"):
            return {}
        log_std = policy.log_std.detach().double().numpy()
        found: dict[str, Any] = {"log_std": log_std.tolist()}
        if self._onto.shape[1] == log_std.size and not self._representation.polar:
            std = np.exp(log_std)
            found["std_on"] = float(np.sqrt(((self._onto * std) ** 2).sum()))
            found["std_off"] = float(np.sqrt(((self._off * std) ** 2).sum()))
        weights: Any = policy.action_net
        if weights.weight.grad is not None:
            head = weights.weight.grad.double().numpy()
            norms = [p.grad.norm() for p in policy.parameters() if p.grad is not None]
            found["gradient"] = float(torch.stack(norms).norm())
            found["gradient_head_on"] = float(np.linalg.norm(self._along @ head))
            found["gradient_head_off"] = float(np.linalg.norm(head - self._along @ head))
        return found

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the rows as arrays, shape (updates,) or (updates, K), in the order of names."""
        return {name: np.array(values) for name, values in sorted(self.rows.items())}


def _means(policy: Any, observations: Any) -> FloatArray:
    """Return the mean actions of a rollout, shape (steps x envs, K)."""
    if isinstance(observations, dict):
        observations = {k: v.reshape(-1, *v.shape[2:]) for k, v in observations.items()}
    else:
        observations = observations.reshape(-1, *observations.shape[2:])
    with torch.no_grad():
        tensors, _ = policy.obs_to_tensor(observations)
        means = policy.get_distribution(tensors).mode()
    array: FloatArray = means.double().numpy()
    return array


def _length(vectors: FloatArray) -> float:
    """Return the root mean square length of the rows."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
