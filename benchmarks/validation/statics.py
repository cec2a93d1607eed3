"""(c) Wrench-loaded rods against SoRoSim's Cosserat statics.

The wrenches of the files are dead loads in the world frame: read as body-frame loads, the same
rods end 16 to 18 % of their length away.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.validation.common import Row, reference, save
from benchmarks.validation.rod import RODS, Load, RodSpec, equilibrium, read_statics, rod_chain
from clarke_gym.numerics.arrays import FloatArray

# The public model's links and, for the bars, half of its mean error [% of length].
LINKS: dict[int, float | None] = {8: None, 24: 0.35, 48: 0.1}


def tip_errors(rod: RodSpec, shapes: dict[str, FloatArray], links: int) -> FloatArray:
    """Return the tip errors of all shapes [% of length]."""
    chain = rod_chain(rod, links // 4, sim_dt_s=1e-3, damping_time_s=0.0)
    loads = [
        Load("end0", shapes["mid_moment"], shapes["mid_force"]),
        Load("end1", shapes["tip_moment"], shapes["tip_force"]),
    ]
    batch = equilibrium(chain, loads, shapes["gravity"])
    tip = batch.xpos[:, chain.model.body("end1").id]
    gap = np.linalg.norm(tip - shapes["points"][:, -1], axis=1)
    error: FloatArray = 100.0 * gap / rod.length_m
    return error


def run(out: Path) -> list[Row]:
    """Measure both materials for growing numbers of links."""
    rows = []
    figure = Figure((5.0, 3.5))
    axis = figure.subplots()
    for rod in RODS:
        shapes = read_statics(reference("sorosim", rod.statics))
        means = []
        for links, bar in LINKS.items():
            errors = tip_errors(rod, shapes, links)
            conditions = f"{rod.name}, {links} joints, {len(errors)} shapes, gravity, two wrenches"
            mean, worst = float(errors.mean()), float(errors.max())
            rows.append(Row("statics", "mean tip error", conditions, mean, "% L", bar))
            rows.append(Row("statics", "worst tip error", conditions, worst, "% L"))
            means.append(mean)
        axis.loglog(list(LINKS), means, "o-", label=rod.name)
    axis.set(xlabel="joints", ylabel="mean tip error [% of length]")
    axis.legend()
    save(figure, out, "statics")
    return rows
