"""(e) Euler-Bernoulli: deflection of a cantilever and its first bending frequency."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, save
from benchmarks.validation.rod import RODS, RodSpec, rod_chain

ELEMENTS = (1, 2, 3, 6, 12)  # in each half


def beam_errors(rod: RodSpec, elements: int) -> tuple[float, float]:
    """Return the errors of small deflection and first frequency [%]."""
    model = rod_chain(rod, elements, sim_dt_s=1e-3, damping_time_s=0.0).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site("tip").id)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    stiffness = model.jnt_stiffness
    flexural = rod.youngs_modulus_pa * math.pi * rod.radius_m**4 / 4.0
    compliance = (jacobian[0] ** 2 / stiffness).sum()
    exact = rod.length_m**3 / (3.0 * flexural)
    root = np.sqrt(stiffness)
    frequency = np.linalg.eigvalsh(inertia / np.outer(root, root)).max() ** -0.5
    line_density = rod.density_kg_m3 * math.pi * rod.radius_m**2
    first = (1.8751040687 / rod.length_m) ** 2 * math.sqrt(flexural / line_density)
    return 100.0 * (compliance / exact - 1.0), 100.0 * (frequency / first - 1.0)


def run(out: Path) -> list[Row]:
    """Measure both for growing numbers of joints."""
    rows = []
    errors = np.array([beam_errors(RODS[0], elements) for elements in ELEMENTS])
    for elements, (deflection, frequency) in zip(ELEMENTS, errors, strict=True):
        conditions = f"steel rod, {4 * elements} joints, small deflection, no gravity"
        rows.append(Row("beam", "F L^3 / 3 E I", conditions, abs(deflection), "%"))
        rows.append(Row("beam", "first bending frequency", conditions, abs(frequency), "%"))
    figure = Figure((5.0, 3.5))
    axis = figure.subplots()
    for column, label in enumerate(("deflection", "first frequency")):
        axis.loglog(4 * np.array(ELEMENTS), np.abs(errors[:, column]), "o-", label=label)
    axis.set(xlabel="joints", ylabel="error [%]")
    axis.legend()
    save(figure, out, "beam")
    return rows
