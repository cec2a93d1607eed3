"""Constant curvature against independent rod solvers and a real robot, where data is present."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from clarke_gym import kinematics
from clarke_gym.physics.statics import bending_from_disk_displacements, shape_from_tension
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.presets import PRESETS

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference"
RODS = REFERENCE / "tdcr_reference.csv"
HARDWARE = REFERENCE / "hardware_tdcr_v4"

LOADS = ("Fx_N", "Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm")


def read(path):
    if not path.exists():
        pytest.skip(f"reference data is not present: {path}")
    with path.open() as file:
        return list(csv.DictReader(file))


def robot_of(row):
    n = int(row["n_tendon_per_seg"])
    return Robot(
        tuple(
            Segment(
                length_m=float(row[f"L{k + 1}_m"]),
                n_tendons=n,
                pitch_radius_m=float(row[f"d{k + 1}_m"]),
                tendon_angles_rad=tuple(
                    np.radians(float(row[f"psi{k * n + i + 1}_deg"])) for i in range(n)
                ),
                backbone_diameter_m=2.0 * float(row["r_backbone_m"]),
                youngs_modulus_pa=float(row["E_Pa"]),
                shear_modulus_pa=float(row["G_Pa"]),
                n_disks=int(row[f"disks{k + 1}"]),
            )
            for k in range(int(row["n_seg"]))
        )
    )


def numbers(row, pattern, count):
    cells = [row[pattern.format(i + 1)] for i in range(count)]
    return np.array([float(cell) for cell in cells]) if all(cells) else None


def tip_errors(model, loaded, shape):
    """Return tip errors [m] of `shape(row, robot)` over the converged rows, and the lengths."""
    errors, lengths = [], []
    for row in read(RODS):
        if row["model"] != model or row["converged"] != "1":
            continue
        if any(float(row[name]) for name in LOADS) != loaded:
            continue
        robot = robot_of(row)
        predicted = shape(row, robot)
        if predicted is None:
            continue
        tip = [float(row[f"p{axis}_m"]) for axis in "xyz"]
        errors.append(np.linalg.norm(kinematics.forward(*predicted)[0] - tip))
        lengths.append(robot.length_m)
    return np.array(errors), np.array(lengths)


def from_tension(row, robot):
    return shape_from_tension(numbers(row, "q{}_N", robot.n_joints), robot)


def from_displacement(row, robot):
    rho = numbers(row, "rho{}_m", robot.n_joints)
    if rho is None:
        return None
    return bending_from_disk_displacements(rho, robot), robot.lengths


def test_tension_driven_constant_curvature_is_the_cosserat_rod_without_tip_load():
    errors, _ = tip_errors("CR", False, from_tension)
    assert len(errors) == 55  # of two independent solvers
    assert errors.max() < 1e-10


def test_displacement_driven_constant_curvature_with_chords_is_the_disk_model():
    errors, lengths = tip_errors("SSCR", False, from_displacement)
    assert len(errors) == 42
    assert (errors / lengths).max() < 3e-4


def test_under_tip_loads_constant_curvature_is_wrong_by_a_stated_amount():
    tension, lengths = tip_errors("CR", True, from_tension)
    assert len(tension) == 10
    assert 0.10 < (tension / lengths).mean() < 0.30
    displacement, lengths = tip_errors("SSCR", True, from_displacement)
    share = displacement / lengths
    assert 0.03 < share.mean() < 0.04
    assert 0.06 < share.max() < 0.08


def hardware(name):
    """Return displacements by tendon [m] and tips [m]; single-tendon pulls excluded."""
    labels = {row["pattern_label"] for row in read(HARDWARE / "tendon_pull.csv")}
    servo = {}
    for label in labels:
        tendon, identity = re.match(r"rep\d+_tendon(\d+)_id(\d+)_", label).groups()
        servo[int(tendon)] = identity
    rows = [row for row in read(HARDWARE / name) if "tendon" not in row["pattern_label"]]
    rho = [[float(row[f"servo_{servo[t]}_mm"]) for t in range(9)] for row in rows]
    tip = [[float(row[f"tip_{axis}"]) for axis in "xyz"] for row in rows]
    return np.array(rho) * 1e-3, np.array(tip) * 1e-3


def mean_error_mm(data, gains):
    """Return the mean tip error after the mean offset is taken out."""
    rho, tip = data
    robot = PRESETS["hardware"]
    clarke = (rho @ robot.encoder.T).reshape(-1, 3, 2)
    bending = kinematics.clarke_to_bending(clarke, robot.pitch_radii) * np.array(gains)[:, None]
    gap = kinematics.forward(bending, robot.lengths)[0] - tip
    return 1e3 * np.linalg.norm(gap - gap.mean(axis=0), axis=1).mean()


def test_nominal_design_on_recordings_of_a_real_robot():
    validation = hardware("val.csv")
    assert mean_error_mm(validation, (0.0, 0.0, 0.0)) == pytest.approx(65.2, abs=0.05)
    assert mean_error_mm(validation, (1.0, 1.0, 1.0)) == pytest.approx(16.05, abs=0.05)


def test_three_gains_fitted_on_training_recordings():
    training = hardware("train.csv")
    fit = minimize(lambda g: mean_error_mm(training, g), np.ones(3), method="Nelder-Mead")
    np.testing.assert_allclose(fit.x, [0.88, 0.99, 1.25], rtol=0, atol=0.01)
    assert mean_error_mm(hardware("val.csv"), fit.x) == pytest.approx(12.06, abs=0.05)
