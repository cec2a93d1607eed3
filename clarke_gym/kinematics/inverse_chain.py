"""Numerical inverse kinematics of segments in series: damped, batched, within bending limits."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clarke_gym.kinematics.dome import sample_dome
from clarke_gym.kinematics.inverse import bending_from_quaternion, segment_inverse
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.kinematics.poses import forward
from clarke_gym.kinematics.quaternions import quaternion_multiply
from clarke_gym.numerics.arrays import Array, FloatArray, array_namespace, as_floating, matrix_like
from clarke_gym.numerics.batch import shortened

_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
_FIRST_DAMPING = 1e-2


def saturate_bending(bending: FloatArray, max_bending: Array) -> FloatArray:
    """Return bending vectors shortened to at most a limit, their directions kept.

    Parameters
    ----------
    bending : ndarray, shape (..., S, 2)
        [rad].
    max_bending : array_like, shape (S,)
        [rad].

    Returns
    -------
    ndarray, shape (..., S, 2)
        [rad].

    Examples
    --------
    >>> saturate_bending(np.array([[3.0, 4.0]]), 1.0)
    array([[0.6, 0.8]])
    """
    limit = np.broadcast_to(np.asarray(max_bending, np.float64), bending.shape[:-1])
    result: FloatArray = np.stack(shortened(bending[..., 0], bending[..., 1], limit), -1)
    return result


def _rotation_error(target: FloatArray, reached: FloatArray) -> FloatArray:
    """Return the rotation vector that turns `reached` into `target`, in the base frame."""
    turn = quaternion_multiply(target, reached * np.array([1.0, -1.0, -1.0, -1.0]))
    turn = turn * np.where(turn[..., :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(turn[..., 1:], axis=-1)
    angle = 2.0 * np.arctan2(sine, turn[..., 0])
    ratio = np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 2.0)
    result: FloatArray = ratio[..., None] * turn[..., 1:]
    return result


class _Problem:
    """Errors and Jacobians of a batch of rows, positions in units of the robot's length."""

    def __init__(
        self, position: FloatArray, quaternion: FloatArray | None, lengths: Sequence[float]
    ) -> None:
        self.scale = float(sum(lengths))
        self.lengths = [length / self.scale for length in lengths]
        self.position = position / self.scale
        self.quaternion = quaternion

    def error(self, bending: FloatArray, rows: Array) -> FloatArray:
        reached, turn = forward(bending, self.lengths)
        gap: FloatArray = self.position[rows] - reached
        if self.quaternion is None:
            return gap
        return np.concatenate([gap, _rotation_error(self.quaternion[rows], turn)], axis=-1)

    def jacobian(self, bending: FloatArray) -> FloatArray:
        jacobian: FloatArray = tip_jacobian(bending, self.lengths)
        return jacobian if self.quaternion is not None else jacobian[:, :3]


def damped_step(jacobian: FloatArray, error: FloatArray, damping: FloatArray) -> FloatArray:
    r"""Return the damped least-squares step :math:`(J^TJ + \lambda I)^{-1}J^Te` (Levenberg).

    Parameters
    ----------
    jacobian : ndarray, shape (B, m, k)
    error : ndarray, shape (B, m)
    damping : ndarray, shape (B,)
        lambda > 0.

    Returns
    -------
    ndarray, shape (B, k)

    Examples
    --------
    >>> damped_step(np.array([[[2.0]]]), np.array([[1.0]]), np.array([1e-12])).round(6)
    array([[0.5]])
    """
    rows, columns = jacobian.shape[1:]
    transposed = np.swapaxes(jacobian, 1, 2)
    if rows < columns:  # the same step through the smaller system
        gram = jacobian @ transposed + damping[:, None, None] * np.eye(rows)
        short: FloatArray = (transposed @ _solution(gram, error[..., None]))[..., 0]
        return short
    gram = transposed @ jacobian + damping[:, None, None] * np.eye(columns)
    step: FloatArray = _solution(gram, transposed @ error[..., None])[..., 0]
    return step


def _solution(gram: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of symmetric systems (B, k, k), the shortest where damping got lost."""
    try:
        return np.asarray(np.linalg.solve(gram, right), np.float64)
    except np.linalg.LinAlgError:
        lost = (np.linalg.matrix_rank(gram, hermitian=True) < gram.shape[-1])[:, None, None]
        whole = np.linalg.solve(np.where(lost, np.eye(gram.shape[-1]), gram), right)
        return np.where(lost, np.linalg.pinv(gram, hermitian=True) @ right, whole)


def _limited_step(
    jacobian: FloatArray,
    error: FloatArray,
    damping: FloatArray,
    bending: FloatArray,
    limit: FloatArray,
) -> FloatArray:
    """Return a damped step that slides along the limits of segments it would push further out."""
    step = damped_step(jacobian, error, damping).reshape(bending.shape)
    size = np.hypot(bending[..., 0], bending[..., 1])
    outward = np.einsum("bsi,bsi->bs", step, bending) > 0.0
    held = outward & (size >= limit * (1.0 - 1e-12))
    rows = np.flatnonzero(held.any(axis=1))
    if len(rows):
        radial = (bending[rows] / size[rows, :, None]) * held[rows, :, None]
        blocks = jacobian[rows].reshape(len(rows), -1, *bending.shape[1:])
        blocks = blocks - np.einsum("bmsi,bsi,bsj->bmsj", blocks, radial, radial)
        tangent = damped_step(blocks.reshape(jacobian[rows].shape), error[rows], damping[rows])
        step[rows] = tangent.reshape(step[rows].shape)
    return step


def _descend(
    problem: _Problem | _Fit,
    start: FloatArray,
    rows: Array,
    limit: FloatArray,
    iterations: int,
    tolerance: float,
) -> tuple[FloatArray, FloatArray]:
    """Return bending vectors and error norms after at most `iterations` steps; all rows at once."""
    bending, error = start.copy(), problem.error(start, rows)
    cost = np.einsum("bi,bi->b", error, error)
    gain = np.full(len(rows), _FIRST_DAMPING)
    idle = np.zeros(len(rows), dtype=int)
    for _ in range(iterations):
        active = np.flatnonzero((cost > tolerance**2) & (idle < 12))
        if not len(active):
            break
        # Damping that fades with the error keeps the last steps quadratic.
        damping = gain[active] * cost[active] + 1e-16
        step = _limited_step(
            problem.jacobian(bending[active]), error[active], damping, bending[active], limit
        )
        trial = saturate_bending(bending[active] + step, limit)
        trial_error = problem.error(trial, rows[active])
        trial_cost = np.einsum("bi,bi->b", trial_error, trial_error)
        better = trial_cost < cost[active]
        won = active[better]
        idle[active] = np.where(trial_cost < 0.999 * cost[active], 0, idle[active] + 1)
        bending[won], error[won], cost[won] = trial[better], trial_error[better], trial_cost[better]
        gain[active] = np.clip(gain[active] * np.where(better, 0.3, 8.0), 1e-6, 1e8)
    return bending, np.sqrt(cost)


class _Fit:
    """Errors and Jacobians of any function of shapes, in units of a scale."""

    step = 1e-5
    """Of central differences [rad]."""

    def __init__(
        self, predicted: Callable[[FloatArray], FloatArray], target: FloatArray, scale: Array
    ) -> None:
        self.predicted, self.target, self.scale = predicted, target, scale

    def error(self, bending: FloatArray, rows: Array) -> FloatArray:
        error: FloatArray = (self.target[rows] - self.predicted(bending)) / self.scale
        return error

    def jacobian(self, bending: FloatArray) -> FloatArray:
        count = bending[0].size
        moves = self.step * np.eye(count).reshape(count, 1, *bending.shape[1:])
        ahead, behind = (self.predicted(bending + sign * moves) for sign in (1.0, -1.0))
        slopes = (ahead - behind) / (2.0 * self.step * self.scale)
        return np.moveaxis(slopes, 0, -1)


def fit_bending(
    predicted: Callable[[FloatArray], FloatArray],
    target: FloatArray,
    *,
    start: FloatArray,
    max_bending: Array = 2.0 * math.pi,
    scale: Array = 1.0,
    iterations: int = 60,
    tolerance: float = 1e-9,
) -> tuple[FloatArray, FloatArray]:
    """Return bending vectors whose prediction is nearest to a target, whatever is predicted.

    Levenberg's damped steps as in `inverse_kinematics`, with slopes by central differences.

    Parameters
    ----------
    predicted : callable
        Of bending vectors (..., S, 2) [rad], returns arrays (..., m).
    target : ndarray, shape (B, m)
    start : ndarray, shape (B, S, 2)
        [rad].
    max_bending : float or array_like, shape (S,)
        Bending limits [rad].
    scale : float or array_like, shape (m,)
        What counts as one.
    iterations : int
        Largest number of steps.
    tolerance : float
        Error at which a row has arrived, in units of the scale.

    Returns
    -------
    bending : ndarray, shape (B, S, 2)
        [rad].
    error : ndarray, shape (B,)
        What is left, in units of the scale.

    Examples
    --------
    >>> tip = lambda bending: forward(bending, [0.2, 0.2])[0]
    >>> goal = tip(np.array([[[0.3, 0.4], [-0.2, 0.5]]]))
    >>> bool(fit_bending(tip, goal, start=np.full((1, 2, 2), 0.1))[1][0] < 1e-9)
    True
    """
    limit = np.broadcast_to(np.asarray(max_bending, np.float64), start.shape[1:2])
    problem = _Fit(predicted, target, np.asarray(scale, np.float64))
    rows = np.arange(len(target))
    return _descend(problem, saturate_bending(start, limit), rows, limit, iterations, tolerance)


def inverse_kinematics(
    position: Array,
    lengths: Sequence[float] | FloatArray,
    *,
    quaternion: Array | None = None,
    max_bending: Array = 2.0 * math.pi,
    start: Array | None = None,
    starts: int = 12,
    iterations: int = 60,
    tolerance: float = 1e-13,
) -> tuple[Array, Array]:
    r"""Return bending vectors of segments in series that bring the tip to a pose.

    Levenberg's damped steps, limits kept by radial saturation, repeated from a fixed list of
    starts for the rows that have not arrived. A torch pose gets one more Newton step with
    gradient, so that the derivative of the result is the Jacobian's pseudo-inverse.

    Parameters
    ----------
    position : array, shape (..., 3)
        Tip position [m] in the base frame.
    lengths : array_like, shape (S,)
        Segment lengths [m].
    quaternion : array, shape (..., 4), optional
        Tip orientation (w, x, y, z), too; by default it is free. Two segments have four degrees
        of freedom, so a full pose needs three or more.
    max_bending : float or array_like, shape (S,)
        Bending limits [rad].
    start : ndarray, shape (..., S, 2), optional
        First bending vectors to try [rad]; one segment starts from its closed form.
    starts : int
        Largest number of starts.
    iterations : int
        Largest number of steps from each start.
    tolerance : float
        Error at which a row has arrived, positions over the robot's length, angles in rad.

    Returns
    -------
    bending : array, shape (..., S, 2)
        [rad], the best found.
    error : array, shape (...)
        What is left of the error: position over length, and angle.

    Raises
    ------
    TypeError, ValueError
        If shapes do not fit or the position is not real.

    Examples
    --------
    >>> goal = np.array([0.1, 0.05, 0.33])
    >>> bending, error = inverse_kinematics(goal, [0.2, 0.2], max_bending=2.0)
    >>> bool(error < 1e-11), np.allclose(forward(bending, [0.2, 0.2])[0], goal)
    (True, True)
    """
    position = as_floating(position, "position")
    if array_namespace(position) is not np:
        search = {"start": start, "starts": starts, "iterations": iterations}
        search |= {"max_bending": max_bending, "tolerance": tolerance}
        return _torch_inverse(position, lengths, quaternion, search)
    if position.ndim == 0 or position.shape[-1] != 3:
        raise ValueError(f"position must have a last axis of 3, got {tuple(position.shape)}")
    batch, count = position.shape[:-1], len(lengths)
    flat = np.asarray(position, np.float64).reshape(-1, 3)
    if quaternion is not None:
        quaternion = np.broadcast_to(np.asarray(quaternion, np.float64), (*batch, 4)).reshape(-1, 4)
    problem = _Problem(flat, quaternion, [float(length) for length in lengths])
    limit: FloatArray = np.broadcast_to(np.asarray(max_bending, np.float64), (count,))
    if start is None:
        first = _first_guess(flat, quaternion, lengths)
    else:
        first = np.broadcast_to(np.asarray(start, np.float64), (*batch, count, 2))
        first = first.reshape(-1, count, 2)
    rows = np.arange(len(flat))
    best, left = _descend(
        problem, saturate_bending(first, limit), rows, limit, iterations, tolerance
    )
    for attempt in range(1, starts):
        rows = np.flatnonzero(left > 10.0 * tolerance)
        if not len(rows):
            break
        # A low-discrepancy sequence: the same starts at every call, spread over the domes.
        ladder = np.arange(1, 2 * count + 1, dtype=np.float64).reshape(count, 2)
        seeds: FloatArray = np.fmod(ladder * (attempt * _GOLDEN), 1.0)
        guess = sample_dome(seeds, np.minimum(limit, 5.0))
        again, error = _descend(
            problem, np.tile(guess, (len(rows), 1, 1)), rows, limit, iterations, tolerance
        )
        better = error < left[rows]
        best[rows[better]], left[rows[better]] = again[better], error[better]
    dtype = position.dtype
    return best.reshape(*batch, count, 2).astype(dtype), left.reshape(batch).astype(dtype)


def _first_guess(
    position: FloatArray, quaternion: FloatArray | None, lengths: Sequence[float] | FloatArray
) -> FloatArray:
    """Return one arc through the position, or the closed form of one segment, shared equally."""
    count = len(lengths)
    if quaternion is not None and count == 1:
        return np.asarray(bending_from_quaternion(quaternion))[:, None]
    blocked = (position[:, :2] == 0.0).all(axis=1) & (position[:, 2] <= 0.0)
    safe = np.where(blocked[:, None], [1e-3, 0.0, 1.0], position)
    whole, _ = segment_inverse(safe, float(sum(lengths)))
    size = np.linalg.norm(whole, axis=1, keepdims=True)
    whole = whole * np.minimum(1.0, 1.5 * count / np.maximum(size, 1e-12)) if count > 1 else whole
    guess: FloatArray = np.repeat(whole[:, None] / count, count, axis=1)
    if count > 1:  # a shape in one plane may be a saddle of the error
        guess = guess + 0.05 * np.array([0.3, -0.7]) * np.arange(1, count + 1)[:, None]
    return guess


def _torch_inverse(
    position: Array,
    lengths: Sequence[float] | FloatArray,
    quaternion: Array | None,
    search: dict[str, Any],
) -> tuple[Array, Array]:
    torch = sys.modules["torch"]
    if quaternion is not None:
        quaternion = torch.as_tensor(quaternion, dtype=position.dtype, device=position.device)
    with torch.no_grad():
        given = [
            None if value is None else value.detach().cpu().double().numpy()
            for value in (position, quaternion)
        ]
        bending, error = inverse_kinematics(given[0], lengths, quaternion=given[1], **search)
    found = matrix_like(bending, position)
    # Newton: the solution moves with the goal by the pseudo-inverse.
    moved, jacobian = position - position.detach(), tip_jacobian(found, lengths)
    if quaternion is None:
        jacobian = jacobian[..., :3, :]
    else:
        before = quaternion.detach()
        back = before * before.new_tensor([1.0, -1.0, -1.0, -1.0]) / (before**2).sum(-1, True)
        turned = 2.0 * quaternion_multiply(quaternion, back)[..., 1:]
        moved = torch.cat(torch.broadcast_tensors(moved, turned), -1)
    step = torch.linalg.pinv(jacobian) @ moved[..., None]
    return found + step[..., 0].reshape(found.shape), matrix_like(error, position)
