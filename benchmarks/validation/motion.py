"""(h) Tip paths in motion, taut and slack, against the same model at a time step of 0.1 ms."""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path
from typing import Any
from unittest import mock

import gymnasium as gym
import numpy as np
from matplotlib.figure import Figure

import clarke_gym  # noqa: F401  (registers the environments)
from benchmarks.validation.common import Row, save
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.physics.mujoco.model import PROFILES
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.presets import make_robot

CONTROL_DT = 0.05
FINE_DT = 1e-4
STEPS = 20
PATHS = {"fast": 24, "accurate": 4}
"""Robots that move at once; fewer where the reference takes long."""
SLACK_STEPS = (5e-3, 2.5e-3, 1e-3, 5e-4, 2.5e-4, 2e-4)
SEGMENTS = (1, 2, 3)
N_TENDONS = 3
DWELL = 5
"""Control steps that an alternating command holds."""
MOTIONS = {
    "Clarke, full speed": ("clarke", "increment"),
    "raw, random": ("raw", "increment"),
    "raw, alternating": ("raw", "absolute"),
}


def commands(motion: str, segments: int, paths: int) -> tuple[Robot, list[JointVector]]:
    """Return a robot and what an environment's limits make of one kind of actions."""
    representation, control = MOTIONS[motion]
    robot = make_robot(n_segments=segments, n_tendons=N_TENDONS)
    envs: Any = gym.make_vec(
        "clarke_gym/Reach-v0",
        num_envs=paths,
        vectorization_mode="vector_entry_point",
        robot=robot,
        representation=representation,
        control=control,
        control_dt=CONTROL_DT,
        random_start=False,
    )
    envs.reset(seed=0)
    rng = np.random.default_rng(segments)
    shape = envs.action_space.shape
    held = rng.choice([-1.0, 1.0], shape)
    taken: list[JointVector] = []
    physics = envs.unwrapped.physics
    advance = physics.step

    def recorded(command: JointVector) -> None:
        taken.append(JointVector.from_state(physics.batch, command.get_state()))
        advance(command)

    with mock.patch.object(physics, "step", recorded):
        for step in range(STEPS):
            if motion == "Clarke, full speed":
                angle = rng.uniform(-np.pi, np.pi, (paths, segments))
                action = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(shape)
            elif motion == "raw, random":
                action = rng.uniform(-1.0, 1.0, shape)
            else:
                action = held if step // DWELL % 2 else -held
            envs.step(action)
    envs.close()
    return robot, taken


def tip_path(robot: Robot, taken: list[JointVector], paths: int, **options: Any) -> FloatArray:
    """Return the tips after every control step [m], shape (steps, paths, 3)."""
    physics = MujocoPhysics(robot, paths, CONTROL_DT, threads=1, **options)
    tips = []
    for command in taken:
        physics.step(command)
        assert not physics.state.diverged.any()
        tips.append(physics.state.tip_position.copy())
    return np.array(tips)


def gaps(path: FloatArray, fine: FloatArray, robot: Robot) -> tuple[float, float]:
    """Return RMS and largest distance of two tip paths [% of length]."""
    gap = 100.0 * np.linalg.norm(path - fine, axis=-1) / robot.length_m
    return float(np.sqrt((gap**2).mean())), float(gap.max())


def run(out: Path) -> list[Row]:
    """Measure every kind of motion, number of segments and profile."""
    rows, curves = [], {}
    for profile, paths in PATHS.items():
        for motion in MOTIONS:
            for segments in SEGMENTS:
                robot, taken = commands(motion, segments, paths)
                fine = tip_path(robot, taken, paths, profile=profile, sim_dt_s=FINE_DT)
                rms, worst = gaps(tip_path(robot, taken, paths, profile=profile), fine, robot)
                noun = "segment" if segments == 1 else "segments"
                conditions = (
                    f"{profile}, {motion}, {segments} {noun}, n = {N_TENDONS}, "
                    f"{paths} paths of {STEPS * CONTROL_DT:g} s, {1e3 * CONTROL_DT:g} ms control"
                )
                rows.append(Row("motion", "tip path RMS to 0.1 ms", conditions, rms, "% L", 0.1))
                rows.append(Row("motion", "largest tip gap to 0.1 ms", conditions, worst, "% L"))
                if profile == "fast" and motion != "Clarke, full speed":
                    curves[f"{segments} {noun}, {motion}"] = over_steps(robot, taken, paths, fine)
    for name, points in curves.items():
        for step, (rms, cost) in points.items():
            case = f"fast, repeated control steps in time steps of {1e3 * step:g} ms"
            rows.append(Row("motion", case, f"{name}, RMS to 0.1 ms", rms, "% L"))
            rows.append(Row("motion", case, f"{name}, time over that with 5 ms", cost, ""))
    save(draw(curves), out, "motion")
    return rows


def over_steps(
    robot: Robot, taken: list[JointVector], paths: int, fine: FloatArray
) -> dict[float, tuple[float, float]]:
    """Return the path's RMS [% of length] and its cost, by the time step of repeated steps [s]."""
    points: dict[float, tuple[float, float]] = {}
    first = 0.0
    for step in SLACK_STEPS:
        profile = dataclasses.replace(PROFILES["fast"], slack_dt_s=step)
        with mock.patch.dict(PROFILES, {"fast": profile}):
            begin = time.perf_counter()
            path = tip_path(robot, taken, paths)
            cost = time.perf_counter() - begin
        first = first or cost
        points[step] = gaps(path, fine, robot)[0], cost / first
    return points


def draw(curves: dict[str, dict[float, tuple[float, float]]]) -> Figure:
    """Return the figure of error and cost over the time step of repeated control steps."""
    figure = Figure((8.0, 3.5))
    axes = figure.subplots(1, 2)
    for name, points in curves.items():
        steps = 1e3 * np.array(list(points))
        style = {"color": f"C{name[0]}", "linestyle": "-" if "random" in name else ":"}
        for axis, values in zip(axes, zip(*points.values(), strict=True), strict=True):
            axis.plot(steps, values, marker="o", label=name, **style)
    axes[0].axhline(0.1, color="0.6", linewidth=1.0)
    for axis, label in zip(
        axes, ("tip path RMS [% of length]", "time over that with 5 ms"), strict=True
    ):
        axis.set(xscale="log", yscale="log", xlabel="time step of slack steps [ms]", ylabel=label)
        marks = [1e3 * step for step in SLACK_STEPS[:-1]]
        axis.set_xticks(marks, [f"{mark:g}" for mark in marks])
        axis.minorticks_off()
        axis.grid(alpha=0.3)
    axes[1].legend(fontsize=7)
    return figure
