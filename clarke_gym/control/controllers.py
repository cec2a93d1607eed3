"""Classical controllers on the interface of a policy: the reference line of every report.

All of them work on the manifold: measured displacements go through M_P, the control law acts on two
numbers a segment, and M_P^-1 takes its output back to the tendons. Commands leave in whatever
representation the environment expects. The transform is that of the robot's description: with
coordinates of a layout that differs from it (`clarke_layout`) shapes are off by as much.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym.control.curl import CurlController
from clarke_gym.control.manifold_interface import ManifoldInterface, Sensed
from clarke_gym.control.mppi import MppiController
from clarke_gym.control.ways import clear_way
from clarke_gym.kinematics.inverse_chain import (
    damped_step,
    fit_bending,
    inverse_kinematics,
    saturate_bending,
)
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.numerics.checks import check_not_negative, check_positive
from clarke_gym.tasks import GoalTask, ObstructedTask, Wrap

FloatArray = NDArray[np.float64]

PLAN_STARTS = 64
"""Shapes from which the plan of a new goal is searched; the one that is reached first is taken."""

PASSED_RAD = 0.05
"""How near to a shape on its way a robot must come before it heads for the next."""

REPLAN_SHARE = 0.05
"""A goal that jumps by more than this share of the robot's length is a new goal."""


@dataclass(frozen=True)
class Gains:
    """Gains of the loops on the manifold, and the memory of the tip's correction.

    Parameters
    ----------
    proportional : float
        Kp [1/s]: rate of the command = rate of the target + Kp (target - measured); the rate of the
        target is the precompensation.
    integral : float
        Ki [1/s^2], of the integral of the same error.
    derivative : float
        Kd, on the rate of the measured displacement.
    tip_memory_s : float
        The gap between tip and model, averaged over this time [s], corrects the target. A mean over
        a period of the arm's slowest swing does not feed that swing. 0 trusts the model.
    speed_share : float
        Share of the drives' speed that the loops use: full speed makes a long arm swing.

    Raises
    ------
    ValueError
        If a gain or the memory is negative or not finite, or the share is not above 0, at most 1.
    """

    proportional: float = 4.0
    integral: float = 0.0
    derivative: float = 0.0
    tip_memory_s: float = 0.3
    speed_share: float = 0.9

    def __post_init__(self) -> None:
        for name in ("proportional", "integral", "derivative", "tip_memory_s"):
            check_not_negative(name, getattr(self, name))
        if check_positive("speed_share", self.speed_share) > 1.0:
            raise ValueError(f"speed_share must be above 0, at most 1, got {self.speed_share!r}")


class TipController:
    """Brings the tip to the goal: inverse kinematics, and PID loops on the manifold.

    The sheet's scheme, per Clarke coordinate a proportional loop with precompensation between M_P
    and M_P^-1, follows a target shape from inverse kinematics. Of the shapes that reach the goal
    the plan takes the one whose tendons get there first. What the measured tip differs from the
    constant-curvature model corrects the target, so that the model need not be exact.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose task has a goal position.
    gains : Gains, optional

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its goal is no position.
    """

    def __init__(self, env: Any, gains: Gains | None = None) -> None:
        self._interface = ManifoldInterface(env)
        self._gains = Gains() if gains is None else gains
        self._robot = self._interface.robot
        self._predicted = self._model(self._interface.task)
        self._goal: FloatArray | None = None

    def _model(self, task: GoalTask) -> Callable[[FloatArray], FloatArray]:
        """Return what tells what shapes achieve; of a position that is where the tip comes."""
        if type(task).predicted is not GoalTask.predicted:
            return task.predicted
        if self._interface.is_position:
            return lambda bending: kinematics.forward(bending, self._robot.lengths)[0]
        raise ValueError(
            f"controllers plan with what shapes achieve; {type(task).__name__} has no `predicted`"
        )

    def reset(self) -> None:
        """Forget everything: the next observation starts new episodes."""
        self._goal = None

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions (B, k) for a batch of observations, or (k,) for a single one."""
        now = self._interface.sense(observation)
        self._follow(now)
        action = self._interface.act(self._command(now), now.command, self._gains.speed_share)
        return self._interface.answer(observation, action)

    def _follow(self, now: Sensed) -> None:
        """Bring targets up to date: plan new goals, correct the others by the measured tip."""
        bending = self._bending(now.displacement)
        if self._goal is None or len(self._goal) != len(now.goal):
            self._goal = np.full_like(now.goal, np.inf)
            self._target = bending.copy()
            self._ways: list[list[FloatArray]] = [[] for _ in bending]
            memory = self._gains.tip_memory_s / self._interface.control_dt
            memory = max(round(memory), math.ceil(min(memory, 1.0)))
            self._gaps = np.full((memory, *now.goal.shape), np.nan)
            self._sum, self._last = np.zeros_like(now.displacement), now.displacement.copy()
        jump = np.linalg.norm((now.goal - self._goal) / self._interface.goal_scale, axis=1)
        fresh = ~(jump <= REPLAN_SHARE)
        self._goal, moving = now.goal, jump > 1e-6
        before = self._target.copy()
        if fresh.any():
            self._gaps[:, fresh], self._sum[fresh] = np.nan, 0.0
            self._last[fresh] = now.displacement[fresh]
            for row, way in zip(
                np.flatnonzero(fresh),
                self._plan(now.goal[fresh], bending[fresh], fresh),
                strict=True,
            ):
                self._target[row], self._ways[row] = way[0], way[1:]
        bias = np.zeros_like(now.goal)
        if len(self._gaps):
            self._gaps = np.roll(self._gaps, 1, axis=0)
            self._gaps[0] = now.achieved - self._predicted(bending)
            bias = np.nanmean(self._gaps, axis=0)
        on_way = np.array([bool(way) for way in self._ways])
        for row in np.flatnonzero(on_way & ~fresh):
            if np.abs(bending[row] - self._target[row]).max() < PASSED_RAD:
                self._target[row] = self._ways[row].pop(0)
        rows = np.flatnonzero(~fresh & ~on_way)
        if len(rows):
            self._target[rows] = self._solve(now.goal[rows] - bias[rows], self._target[rows], 8)[0]
        # The target's own motion is precompensated where the goal moves; corrections are not: fed
        # forward they would swing the arm.
        follow = (moving & ~fresh)[:, None, None]
        self._before = np.where(follow, before, self._target)

    def _plan(
        self, goal: FloatArray, bending: FloatArray, fresh: FloatArray
    ) -> list[list[FloatArray]]:
        """Return for each goal the shapes to pass, the last one that of the goal.

        Of the shapes that reach it, that is the one that the slowest tendon reaches first.
        """
        robot, starts = self._robot, PLAN_STARTS if self._robot.n_segments > 1 else 1
        rng = np.random.default_rng(0)  # the same starts at every call
        spread = np.linspace(0.0, 1.0, starts)[:, None, None, None]
        noise = rng.normal(size=(starts, 1, *bending.shape[1:])) * spread
        guesses = saturate_bending(bending + noise, robot.max_bending)
        goals = np.broadcast_to(goal, (starts, *goal.shape))
        shapes, error = self._solve(goals, guesses, 40, 1 if starts > 1 else 3)
        change = kinematics.bending_to_clarke(shapes - bending, robot.pitch_radii)
        effort = np.hypot(change[..., 0], change[..., 1]).max(axis=-1) / robot.length_m
        cost = effort + 1e3 * np.maximum(error - 1e-6, 0.0)
        if not isinstance(self._interface.task, ObstructedTask):
            best = np.argmin(cost, axis=0)
            return [[shapes[k, row]] for row, k in enumerate(best)]
        order, bodies = np.argsort(cost, axis=0), self._interface.bodies[fresh]
        return [
            clear_way(self._interface.task, bodies[row], bending[row], shapes[order[:, row], row])
            for row in range(len(goal))
        ]

    def _solve(
        self, goal: FloatArray, start: FloatArray, iterations: int, starts: int = 1
    ) -> tuple[FloatArray, FloatArray]:
        """Return the shapes nearest to goals (..., k), and what is left."""
        robot, interface = self._robot, self._interface
        if interface.is_position:
            found: tuple[FloatArray, FloatArray] = inverse_kinematics(
                goal,
                robot.lengths,
                max_bending=robot.max_bending,
                start=start,
                starts=starts,
                iterations=iterations,
                tolerance=1e-9,
            )
            return found
        shapes, error = fit_bending(
            self._predicted,
            goal.reshape(-1, goal.shape[-1]),
            start=start.reshape(-1, *start.shape[-2:]),
            max_bending=robot.max_bending,
            scale=interface.goal_scale,
            iterations=iterations,
        )
        return shapes.reshape(start.shape), error.reshape(start.shape[:-2])

    def _command(self, now: Sensed) -> FloatArray:
        """Return the command [m] of the loops on the manifold."""
        gains, dt, radii = self._gains, self._interface.control_dt, self._robot.pitch_radii
        target, before = (
            kinematics.bending_to_clarke(shape, radii) for shape in (self._target, self._before)
        )
        error = target - now.displacement
        # Integrate only near the target: a saturated drive must not wind up.
        near = np.abs(error) < 0.5 * self._interface.step_m
        self._sum = self._sum + np.where(near, error * dt, 0.0)
        speed = (now.displacement - self._last) / dt
        self._last = now.displacement
        proportional = min(gains.proportional, 1.0 / dt)  # all of it in one period, and not beyond
        rate = proportional * error + gains.integral * self._sum - gains.derivative * speed
        command: FloatArray = now.command + (target - before) + rate * dt
        return command

    def _bending(self, clarke: FloatArray) -> FloatArray:
        bending: FloatArray = kinematics.clarke_to_bending(clarke, self._robot.pitch_radii)
        return bending


class ResolvedRateController:
    """Moves the tip straight at the goal: tip velocity through the damped inverse Jacobian.

    No plan: the Jacobian of the measured shape turns the gap between goal and tip into rates of the
    Clarke coordinates, all slowed down alike to what the drives can do. It needs no inverse
    kinematics, but can stay long at a bending limit: with several segments and from random shapes
    it reaches four goals of five within 50 steps, nearly all within 200.

    Parameters
    ----------
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose task has a goal position.
    gain : float
        Share of the gap to close in one step. On MuJoCo several segments swing at 0.6; 0.2 is calm.
    damping : float
        Damping of the inverse, relative to the robot's length: near straight shapes, where the tip
        cannot move along itself, a small one makes segments bend against each other.

    Raises
    ------
    TypeError, ValueError
        If it is another environment, or its goal is no position.
    """

    def __init__(self, env: Any, gain: float = 0.6, damping: float = 0.1) -> None:
        self._interface = ManifoldInterface(env)
        if not self._interface.is_position:
            raise ValueError(
                f"resolved_rate moves the tip to a position; {type(self._interface.task).__name__} "
                "asks for something else"
            )
        self._gain, self._damping = gain, damping

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, observation: Any) -> NDArray[np.float32]:
        """Return actions (B, k) for a batch of observations, or (k,) for a single one."""
        now, robot = self._interface.sense(observation), self._interface.robot
        bending: FloatArray = kinematics.clarke_to_bending(now.displacement, robot.pitch_radii)
        jacobian = tip_jacobian(bending, robot.lengths)[:, :3] / robot.length_m
        gap = self._gain * (now.goal - now.achieved) / robot.length_m
        step = damped_step(jacobian, gap, np.full(len(gap), self._damping**2))
        step = step.reshape(bending.shape)
        # Slowed down before limits of bends act: they would turn a long step another way.
        step /= self._interface.periods(kinematics.bending_to_clarke(step, robot.pitch_radii))
        moved = saturate_bending(bending + step, robot.max_bending)
        change = kinematics.bending_to_clarke(moved - bending, robot.pitch_radii)
        action = self._interface.act(now.command + change, now.command)
        return self._interface.answer(observation, action)


Controller = TipController | ResolvedRateController | MppiController | CurlController

CONTROLLERS = ("clarke_controller", "clarke_pid", "clarke_model_only", "resolved_rate", "mppi")
"""Names that `make_controller` knows."""


def make_controller(name: str, env: Any) -> Controller:
    """Return a classical controller for an environment.

    Parameters
    ----------
    name : str
        "clarke_controller": planned shape, proportional loops with precompensation on the manifold,
        corrected by the measured tip; on Wrap, bends that follow from the cylinder
        (`CurlController`). "clarke_pid": the same with integral and derivative terms.
        "clarke_model_only": the same without the tip's correction, the sheet's scheme alone.
        "resolved_rate": straight at the goal through the inverse Jacobian. "mppi": plans sampled on
        constant curvature.
    env : gymnasium.Env or gymnasium.vector.VectorEnv
        A clarke_gym environment whose task has a goal position, or Wrap.

    Returns
    -------
    Controller
        With ``act(observation)``, like a policy, and ``reset()``.

    Raises
    ------
    TypeError, ValueError
        If the name is unknown, or the environment has no goal position.

    Examples
    --------
    >>> import gymnasium as gym, clarke_gym
    >>> env = gym.make("clarke_gym/Reach-v0", n_tendons=5, representation="clarke")
    >>> observation, _ = env.reset(seed=0)
    >>> make_controller("clarke_controller", env).act(observation).shape
    (2,)
    """
    if name == "clarke_controller":
        winds = isinstance(getattr(env.unwrapped, "task", None), Wrap)
        return CurlController(env) if winds else TipController(env)
    if name == "clarke_pid":
        return TipController(env, Gains(integral=1.0, derivative=0.1))
    if name == "clarke_model_only":
        return TipController(env, Gains(tip_memory_s=0.0))
    if name == "resolved_rate":
        return ResolvedRateController(env)
    if name == "mppi":
        return MppiController(env)
    raise ValueError(f"controller must be one of {list(CONTROLLERS)}, got {name!r}")
