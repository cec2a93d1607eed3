"""(f) How far constant curvature is from MuJoCo, over bend, gravity and payload."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, save
from clarke_gym import kinematics
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.presets import PRESETS

ANGLES = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
CASES = (  # gravity in the base frame [m/s^2], payload [kg]
    ("no gravity", (0.0, 0.0, 0.0), 0.0),
    ("hanging", (0.0, 0.0, 9.80665), 0.0),
    ("standing", (0.0, 0.0, -9.80665), 0.0),
    ("standing, 10 g", (0.0, 0.0, -9.80665), 0.01),
    ("horizontal", (0.0, 9.80665, 0.0), 0.0),
    ("horizontal, 10 g", (0.0, 9.80665, 0.0), 0.01),
)


def tip_gaps(
    robot: Robot, gravity: tuple[float, float, float], payload: float, profile: str
) -> FloatArray:
    """Return the distance of the two models' tips at rest [% of length] for every bend."""
    bending = np.zeros((len(ANGLES), robot.n_segments, 2))
    bending[:, :, 0] = ANGLES[:, None]
    clarke = np.asarray(kinematics.bending_to_clarke(bending, robot.pitch_radii))
    physics = MujocoPhysics(
        robot,
        len(bending),
        0.05,
        profile=profile,
        threads=2,
        gravity_m_s2=gravity,
        payload_kg=payload,
    )
    physics.reset(np.arange(len(bending)), clarke)
    for _ in range(60):
        physics.step(JointVector.from_clarke(clarke))
    arc, _ = kinematics.forward(bending, robot.lengths)
    gap = np.linalg.norm(physics.state.tip_position - arc, axis=1)
    percent: FloatArray = 100.0 * gap / robot.length_m
    return percent


def run(out: Path) -> list[Row]:
    """Measure a stiff and a soft robot in every case."""
    rows = []
    figure = Figure((8.0, 3.5))
    axes = figure.subplots(1, 2)
    for axis, name in zip(axes, ("default", "soft_arm"), strict=True):
        for case, gravity, payload in CASES:
            gaps = tip_gaps(PRESETS[name], gravity, payload, "accurate")
            conditions = f"{name}, accurate, {case}, 0 to 90 deg"
            rows.append(Row("gap", "largest tip gap", conditions, float(gaps.max()), "% L"))
            axis.plot(np.degrees(ANGLES), gaps, label=case)
        axis.set(title=name, xlabel="commanded bend [deg]", ylabel="tip gap [% of length]")
    axes[0].legend(fontsize=7)
    save(figure, out, "gap")
    return rows
