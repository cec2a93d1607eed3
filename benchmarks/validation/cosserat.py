"""(b) Tension-driven robots against independent Cosserat-rod solutions, with and without load."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, reference, save
from benchmarks.validation.rod import Load, equilibrium
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco.model import PROFILES, build_chain
from clarke_gym.robots import Robot, Segment

BARS = {"median": 0.5, "worst": 1.5}  # % of length, profile "accurate" against CR
MODELS = ("CR", "SSCR")
VARIANTS = (("fast", "ideal"), ("accurate", "ideal"), ("fast", "chord"), ("accurate", "chord"))
Table = dict[str, dict[str, str]]


def read_cases(path: Path) -> tuple[Table, dict[str, dict[str, FloatArray]]]:
    """Return one row of inputs for every case, and the tips [m] of every model."""
    inputs: Table = {}
    tips: dict[str, dict[str, FloatArray]] = defaultdict(dict)
    with path.open() as file:
        for row in csv.DictReader(file):
            inputs.setdefault(row["case"], row)
            if row["code"] == "indep_py" and row["converged"] == "1":
                tips[row["case"]][row["model"]] = np.array([float(row[f"p{a}_m"]) for a in "xyz"])
    return inputs, tips


def robot_of(row: dict[str, str]) -> Robot:
    """Return the robot of one case."""
    count, n = int(row["n_seg"]), int(row["n_tendon_per_seg"])
    segments = []
    for s in range(count):
        degrees = [float(row[f"psi{s * n + i + 1}_deg"]) for i in range(n)]
        segments.append(
            Segment(
                length_m=float(row[f"L{s + 1}_m"]),
                n_tendons=n,
                pitch_radius_m=float(row[f"d{s + 1}_m"]),
                tendon_angles_rad=tuple(np.radians(degrees).tolist()),
                backbone_diameter_m=2.0 * float(row["r_backbone_m"]),
                youngs_modulus_pa=float(row["E_Pa"]),
                shear_modulus_pa=float(row["G_Pa"]),
                n_disks=int(row[f"disks{s + 1}"]),
            )
        )
    return Robot(tuple(segments))


def tips_of(rows: list[dict[str, str]], profile: str, routing: str) -> FloatArray:
    """Return the tips of one robot's cases at rest [m], shape (cases, 3)."""
    robot = robot_of(rows[0])
    chain = build_chain(
        robot,
        PROFILES[profile],
        routing=routing,
        actuation="tension",
        gravity_m_s2=(0.0, 0.0, 0.0),
    )
    tension = [[float(r[f"q{i + 1}_N"]) for i in range(robot.n_joints)] for r in rows]
    moment = np.array([[float(r[f"M{a}_Nm"]) for a in "xyz"] for r in rows])
    force = np.array([[float(r[f"F{a}_N"]) for a in "xyz"] for r in rows])
    end = f"end{robot.n_segments - 1}"
    batch = equilibrium(chain, [Load(end, moment, force)], control=np.array(tension))
    tip: FloatArray = batch.xpos[:, chain.model.body(end).id]
    return tip


def run(out: Path) -> list[Row]:
    """Compare every case's tip with the Cosserat rods' tips."""
    inputs, tips = read_cases(reference("tdcr_reference.csv"))
    robots: dict[str, list[str]] = defaultdict(list)
    for case, row in inputs.items():
        robots[row["robot"]].append(case)
    rows, series = [], {}
    for profile, routing in VARIANTS:
        errors: dict[tuple[str, bool], list[float]] = defaultdict(list)
        for cases in robots.values():
            reached = tips_of([inputs[case] for case in cases], profile, routing)
            for case, tip in zip(cases, reached, strict=True):
                row = inputs[case]
                length = float(row["L1_m"]) + float(row["L2_m"])
                loaded = any(float(row[k]) for k in ("Fx_N", "Fy_N", "Fz_N")) or any(
                    float(row[k]) for k in ("Mx_Nm", "My_Nm", "Mz_Nm")
                )
                for model in MODELS:
                    if model in tips[case]:
                        gap = float(np.linalg.norm(tip - tips[case][model]))
                        errors[model, loaded].append(100.0 * gap / length)
        for model in MODELS:
            groups = {
                "no tip load": errors[model, False],
                "tip load": errors[model, True],
                "all": errors[model, False] + errors[model, True],
            }
            series[f"{profile}, {routing}, {model}"] = groups["all"]
            for group, values in groups.items():
                for name, value in (("median", np.median(values)), ("worst", np.max(values))):
                    held = (profile, routing, model, group) == ("accurate", "ideal", "CR", "all")
                    conditions = f"{profile}, {routing} routing, {len(values)} cases, {group}"
                    case = f"{name} tip error to {model}"
                    bar = BARS[name] if held else None
                    rows.append(Row("cosserat", case, conditions, float(value), "% L", bar))
    figure = Figure((7.0, 3.5))
    axis = figure.subplots()
    axis.boxplot(list(series.values()), orientation="horizontal")
    axis.set_yticks(range(1, len(series) + 1), list(series))
    axis.set(xlabel="tip error [% of length]")
    save(figure, out, "cosserat")
    return rows
