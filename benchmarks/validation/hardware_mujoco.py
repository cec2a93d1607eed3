"""(h) The environments' MuJoCo physics with the identified numbers, on the held-out recording.

The parameters are those that part "hardware" identifies with a model of its own, the place of the
motion-capture frame among them; nothing is fitted again here. Bending stiffnesses are the
identified ratios of the tendons' stiffness, which is such that the first segment keeps the backbone
of the preset; pretensions are that stiffness times the identified displacements; the play between
servo and tendon is that of the disturbance `backlash`. Friction cannot be identified from rows at
rest and is left out.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, save
from benchmarks.validation.hardware import (
    HALF_COUNT,
    RADIUS_M,
    ROBOT,
    START,
    backlash,
    identify,
    in_frame,
    interval,
    predict,
    read,
    shapes,
)
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.stiffness import bending_stiffness

PERIOD_S, PERIODS = 0.05, 10
"""Half a second under a command, from where the model without inertia is at rest."""

CASES = (
    ("fast", "no gravity", 0.0),
    ("accurate", "no gravity", 0.0),
    ("fast", "hanging", 9.81),
    ("fast", "standing", -9.81),
)
"""Profile and gravity along the straight robot: how it stood is not told with the recordings."""


def identified_robot(parameters: FloatArray) -> Robot:
    """Return the robot that has the identified numbers."""
    ratio, pretension, _, _ = np.abs(parameters[6:]).reshape(4, 3)
    angle = parameters[12:15]
    first = ROBOT.segments[0]
    lever = HALF_COUNT * RADIUS_M**2
    stiffness = bending_stiffness(first) / (first.length_m * float(ratio[0]) * lever)
    segments = []
    for j, segment in enumerate(ROBOT.segments):
        wanted = float(ratio[j]) * lever * stiffness * segment.length_m
        softer = wanted / bending_stiffness(segment)
        segments.append(
            replace(
                segment,
                tendon_angles_rad=tuple((segment.angles + angle[j]).tolist()),
                youngs_modulus_pa=softer * segment.youngs_modulus_pa,
                shear_modulus_pa=softer * segment.shear_modulus_pa,
                tendon_stiffness_n_m=stiffness,
                pretension_n=stiffness * float(pretension[j]) * 1e-3,
            )
        )
    return Robot(tuple(segments), name="identified", actuator_time_constant_s=0.0)


def tips_at_rest(
    parameters: FloatArray, displacement: FloatArray, profile: str, along_m_s2: float
) -> FloatArray:
    """Return the tips [m] under commands (T, 9), each row a robot, in the motion-capture frame."""
    robot = identified_robot(parameters)
    play = np.repeat(np.abs(parameters[15:18]), 3) * 1e-3
    command = backlash(displacement, play)
    clarke = command @ robot.encoder.T
    off_manifold = command - clarke @ robot.decoder.T
    physics = MujocoPhysics(
        robot, len(command), PERIOD_S, profile=profile, gravity_m_s2=(0.0, 0.0, along_m_s2)
    )
    physics.reset(
        np.arange(len(command)), RADIUS_M * shapes(parameters, displacement, all_taut=False)
    )
    for _ in range(PERIODS):
        physics.step(JointVector.from_clarke(clarke.reshape(-1, 3, 2), off_manifold))
    return in_frame(parameters, physics.state.tip_position)


def run(out: Path) -> list[Row]:
    """Report the held-out recording."""
    parameters = identify(len(START), START)
    displacement, measured, counts = read("val.csv")
    quasi_static = predict(parameters, displacement)
    figure = Figure((5.0, 3.5))
    axis = figure.subplots()
    rows = []
    for profile, name, along in CASES:
        tip = tips_at_rest(parameters, displacement, profile, along)
        distance = 1e3 * np.linalg.norm(tip - measured, axis=1)[counts]
        apart = 1e3 * np.linalg.norm(tip - quasi_static, axis=1)[counts]
        low, high = interval(distance)
        conditions = f"{profile}, {name}, identified numbers, val.csv, {len(distance)} rows"
        percent = 1e-1 * float(distance.mean()) / ROBOT.length_m
        for case, value, unit in (
            ("mean tip error", percent, "% L"),
            ("mean tip error", float(distance.mean()), "mm"),
            ("the same, 95 % interval, low", low, "mm"),
            ("the same, 95 % interval, high", high, "mm"),
            ("root mean square tip error", float(np.sqrt((distance**2).mean())), "mm"),
            ("mean gap to the quasi-static model", float(apart.mean()), "mm"),
            ("largest gap to the quasi-static model", float(apart.max()), "mm"),
        ):
            rows.append(Row("hardware_mujoco", case, conditions, value, unit))
        axis.plot(
            np.sort(distance), np.arange(1, len(distance) + 1) / len(distance), label=conditions
        )
    axis.set(xlabel="tip error on val.csv [mm]", ylabel="share of rows")
    axis.legend(fontsize=6)
    save(figure, out, "hardware_mujoco")
    return rows
