r"""PPO whose likelihood is that of what reaches the manifold, and instruments of the same kind.

Let a policy draw :math:`a = \mu(s) + A\,(\sigma \circ \varepsilon)` with
:math:`\varepsilon \sim N(0, I)`, and let the robot move by :math:`u = M a` alone, the Clarke
coordinates of the action; M has the shape (d, K), d = 2 a segment, K coordinates of the
representation. With A = I this is PPO's Gaussian. PPO weighs advantages with the likelihood of *a*,

.. math:: \log N(a;\ \mu, \Sigma), \qquad \Sigma = A\,\mathrm{diag}(\sigma^2)\,A^T,

although K - d directions of *a* change nothing. The marginal of *u* is Gaussian, too,

.. math:: u \sim N(M\mu,\ S), \qquad S = M \Sigma M^T,

and its score is what the score of *a* says about *u*:
:math:`\nabla \log p(u) = E[\nabla \log p(a) \mid u]` (Fisher's identity). Where the return depends
on *a* through *u* alone, both give the same expected gradient,

.. math:: E[R(u)\,\nabla \log p(a)] = E\big[R(u)\,E[\nabla \log p(a) \mid u]\big]
    = E[R(u)\,\nabla \log p(u)],

and the marginal's has the smaller variance (Rao and Blackwell). Ratio, clipping, approximate KL
and entropy then belong to *u* as well: the K - d directions no longer use up the clip range.

If M is square and invertible, :math:`\log p(u) = \log p(a) - \log|\det M|`: a constant, which
neither the ratio nor a gradient knows. PPO on Clarke coordinates is therefore its own marginal, and
the class below leaves SB3's distribution as it is there, bit for bit.

The identity is exact as long as the environment takes *a* as it is. Numbers outside the action
box are clipped after they are drawn, which mixes in what lies off the manifold.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import ArrayLike
from stable_baselines3.common.distributions import DiagGaussianDistribution
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.type_aliases import Schedule
from torch import nn

Likelihood = Literal["joint", "marginal"]
Noise = Literal["coordinates", "manifold"]


def matched_gain(onto: ArrayLike) -> float:
    """Return the gain of the mean at which an optimiser moves it as in Clarke coordinates.

    Adam changes every weight by about its step, whatever the gradient's size. Changes of the K
    outputs that push a Clarke coordinate the same way add up to the sum of magnitudes in its row of
    M: 1 in Clarke coordinates, about sqrt(8 n) / pi in ``raw_scaled``.

    Parameters
    ----------
    onto : array_like, shape (d, K)
        M.

    Examples
    --------
    >>> matched_gain([[1.0, 0.0], [0.0, 1.0]]), matched_gain([[2.0, 2.0, 0.0], [0.0, 2.0, 2.0]])
    (1.0, 0.25)
    """
    return float(1.0 / np.abs(np.asarray(onto, np.float64)).sum(axis=1).mean())


class ManifoldGaussian(DiagGaussianDistribution):
    """Gaussian actions whose noise and likelihood know which of their directions matter.

    Parameters
    ----------
    onto : array_like, shape (d, K)
        M: Clarke coordinates of an action.
    mean_gain : float or "matched"
        What the network's output is multiplied by to give the mean; "matched" for `matched_gain`.
    likelihood : {"joint", "marginal"}
        Of the action, or of its Clarke coordinates.
    noise : {"coordinates", "manifold"}
        K independent numbers, or d of them in Clarke coordinates, which leave the manifold
        nowhere; they have the marginal likelihood alone.

    Raises
    ------
    ValueError
        If `onto` has not the rank d, or noise on the manifold is to have a joint likelihood.

    Examples
    --------
    >>> law = ManifoldGaussian([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], likelihood="marginal")
    >>> _ = law.proba_distribution(torch.zeros(1, 3), torch.zeros(3))
    >>> action = torch.tensor([[0.0, 0.0, 9.0]])  # far out where it does not matter
    >>> round(float(law.log_prob(action)), 4)
    -1.8379
    """

    def __init__(
        self,
        onto: ArrayLike,
        *,
        mean_gain: float | Literal["matched"] = 1.0,
        likelihood: Likelihood = "joint",
        noise: Noise = "coordinates",
    ) -> None:
        matrix = np.asarray(onto, np.float64)
        if matrix.ndim != 2 or np.linalg.matrix_rank(matrix) < len(matrix):
            raise ValueError(f"onto must have as many independent rows as it has, got {matrix!r}")
        if noise == "manifold" and likelihood == "joint":
            raise ValueError("noise='manifold' has no joint likelihood; use likelihood='marginal'")
        super().__init__(matrix.shape[1])
        self._onto = torch.as_tensor(matrix, dtype=torch.float32)
        self.gain = matched_gain(matrix) if mean_gain == "matched" else mean_gain
        """What the network's output is multiplied by."""
        self._on_manifold = noise == "manifold"
        self._lift = torch.as_tensor(np.linalg.pinv(matrix), dtype=torch.float32)
        square = matrix.shape[0] == matrix.shape[1]
        self._marginal = self._on_manifold or (likelihood == "marginal" and not square)
        self._factor = torch.empty(0)

    def proba_distribution_net(
        self, latent_dim: int, log_std_init: float = 0.0
    ) -> tuple[nn.Module, nn.Parameter]:
        """Return the layer of the mean and log_std; d numbers of noise on the manifold, else K."""
        layer, log_std = super().proba_distribution_net(latent_dim, log_std_init)
        if self._on_manifold:
            log_std = nn.Parameter(torch.full((len(self._onto),), float(log_std_init)))
        return layer, log_std

    def proba_distribution(
        self, mean_actions: torch.Tensor, log_std: torch.Tensor
    ) -> ManifoldGaussian:
        """Set the parameters.

        Parameters
        ----------
        mean_actions : Tensor, shape (B, K)
            Output of the network.
        log_std : Tensor, shape (K,), or (d,) for noise on the manifold
        """
        if self.gain != 1.0:
            mean_actions = self.gain * mean_actions
        if self._on_manifold:
            self._mean, self._std = mean_actions, log_std.exp()
            self._factor = torch.diag(self._std)
            return self
        super().proba_distribution(mean_actions, log_std)
        if self._marginal:
            spread = self._onto * log_std.exp()
            self._factor = torch.linalg.cholesky(spread @ spread.T)
        return self

    def mode(self) -> torch.Tensor:
        """Return the mean action, shape (B, K)."""
        return self._mean if self._on_manifold else super().mode()

    def sample(self) -> torch.Tensor:
        """Return actions, shape (B, K)."""
        if not self._on_manifold:
            return super().sample()
        drawn = self._std * torch.randn(len(self._mean), len(self._onto))
        return self._mean + drawn @ self._lift.T

    def log_prob(self, actions: torch.Tensor) -> torch.Tensor:
        """Return the logarithm of the likelihood, shape (B,)."""
        if not self._marginal:
            return super().log_prob(actions)
        away = (actions - self.mode()) @ self._onto.T
        scaled = torch.linalg.solve_triangular(self._factor, away.T, upper=False)
        return -0.5 * (scaled**2).sum(dim=0) - self._log_volume()

    def entropy(self) -> torch.Tensor:
        """Return the differential entropy, shape (B,)."""
        if not self._marginal:
            entropy = super().entropy()
            assert entropy is not None
            return entropy
        return (0.5 * len(self._onto) + self._log_volume()).expand(len(self.mode()))

    def _log_volume(self) -> torch.Tensor:
        """Return log sqrt(det(2 pi S))."""
        half = 0.5 * len(self._onto) * math.log(2.0 * math.pi)
        return self._factor.diagonal().log().sum() + half


class ManifoldPolicy(ActorCriticPolicy):
    """Stable-Baselines3's actor and critic with a `ManifoldGaussian`.

    Parameters
    ----------
    *args, **kwargs
        Of `ActorCriticPolicy`.
    manifold : dict
        Keyword arguments of `ManifoldGaussian`.
    """

    action_dist: ManifoldGaussian

    def __init__(self, *args: Any, manifold: dict[str, Any], **kwargs: Any) -> None:
        self._manifold = manifold
        super().__init__(*args, **kwargs)

    def _build(self, lr_schedule: Schedule) -> None:
        self.action_dist = ManifoldGaussian(**self._manifold)
        super()._build(lr_schedule)


def output_gain(policy: ActorCriticPolicy) -> float:
    """Return what the output of a policy's network is multiplied by to give the mean action."""
    return policy.action_dist.gain if isinstance(policy, ManifoldPolicy) else 1.0
