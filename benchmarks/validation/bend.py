"""(a) Achieved bending angle against the commanded Clarke coordinates."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, save
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.joint_vector import JointVector

COUNTS = (3, 4, 5, 7, 11)
ANGLES = np.radians(np.arange(10, 121, 10))
DIRECTIONS = np.radians([0.0, 17.0, 45.0, 100.0, 200.0])
BARS = {"fast": 1.0, "accurate": 0.3}  # % of the commanded angle


def bend_errors(n: int, profile: str) -> FloatArray:
    """Return the error of the tip's bending angle [%], shape (angles, directions)."""
    robot = Robot((Segment(n_tendons=n, max_bending_rad=2.2),), actuator_time_constant_s=0.0)
    angle, direction = np.meshgrid(ANGLES, DIRECTIONS, indexing="ij")
    bending = angle[..., None] * np.stack([np.cos(direction), np.sin(direction)], axis=-1)
    clarke = robot.pitch_radii[0] * bending.reshape(-1, 1, 2)
    physics = MujocoPhysics(
        robot, len(clarke), 0.05, profile=profile, threads=2, gravity_m_s2=(0.0, 0.0, 0.0)
    )
    physics.reset(np.arange(len(clarke)), 0.9 * clarke)
    for _ in range(30):
        physics.step(JointVector.from_clarke(clarke))
    w, x, y, z = physics.state.tip_quaternion.T
    achieved = 2.0 * np.arctan2(np.hypot(x, y), np.hypot(w, z))
    error: FloatArray = 100.0 * (achieved.reshape(angle.shape) / angle - 1.0)
    return error


def run(out: Path) -> list[Row]:
    """Measure both profiles for every n."""
    rows = []
    figure = Figure((8.0, 3.5))
    axes = figure.subplots(1, 2, sharey=True)
    for axis, (profile, bar) in zip(axes, BARS.items(), strict=True):
        errors = {n: bend_errors(n, profile) for n in COUNTS}
        for n, error in errors.items():
            worst = np.abs(error).max()
            conditions = f"{profile}, 10 to 120 deg, 5 directions, no gravity, at rest"
            rows.append(Row("bend", f"n = {n}, worst", conditions, float(worst), "%", bar))
            axis.plot(np.degrees(ANGLES), np.abs(error).max(1), label=f"n = {n}")
        axis.axhline(bar, color="0.6", linestyle="--")
        axis.set(title=profile, xlabel="commanded bend [deg]", ylabel="worst error [%]")
    axes[0].legend()
    save(figure, out, "bend")
    return rows
