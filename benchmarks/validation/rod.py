"""Bare rods as the package models them, their static equilibria, and the SoRoSim files."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco.batch_engine import QuietEngine
from clarke_gym.physics.mujoco.links import Chain
from clarke_gym.physics.mujoco.model import Profile, build_chain
from clarke_gym.robots import Robot, Segment

RELAXATION_S = 0.1  # damping time of the relaxation to equilibrium, not of any material
TO_Z_UP = np.array([[0.0, 0.0, 1.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]])


@dataclass(frozen=True)
class RodSpec:
    """A clamped rod of the SoRoSim data, as its README describes it."""

    name: str
    statics: str
    dynamics: str
    length_m: float
    radius_m: float
    youngs_modulus_pa: float
    poisson: float
    density_kg_m3: float


RODS = (
    RodSpec(
        "spring steel", "spring_steel_statics.csv", "SpringSteel", 0.6, 8e-4, 200e9, 0.33, 7870.0
    ),
    RodSpec("TPU", "tpu_statics.csv", "TPU", 0.4, 5e-3, 70e6, 0.4, 1200.0),
)


def rod_chain(rod: RodSpec, elements: int, *, sim_dt_s: float, damping_time_s: float) -> Chain:
    """Return a rod of two halves of `elements` elements each, free of tendons and gravity."""
    half = Segment(
        length_m=rod.length_m / 2,
        backbone_diameter_m=2 * rod.radius_m,
        youngs_modulus_pa=rod.youngs_modulus_pa,
        shear_modulus_pa=rod.youngs_modulus_pa / (2 * (1 + rod.poisson)),
        density_kg_m3=rod.density_kg_m3,
        n_disks=1,
        disk_mass_kg=0.0,
        damping_time_s=damping_time_s,
    )
    profile = Profile(elements=elements, sim_dt_s=sim_dt_s, folded=True)
    chain = build_chain(Robot((half, half)), profile, gravity_m_s2=(0.0, 0.0, 0.0))
    chain.model.actuator_gainprm[:] = 0.0
    chain.model.actuator_biasprm[:] = 0.0
    return chain


def relaxed(model: mujoco.MjModel) -> mujoco.MjModel:
    """Change a model so that it creeps to its equilibrium: heavily damped, long steps."""
    model.opt.timestep = 0.2 * RELAXATION_S
    model.dof_damping[:] = RELAXATION_S * model.jnt_stiffness
    return model


@dataclass
class Load:
    """Wrenches on one body of B rods: moments [N m] and forces [N], shape (B, 3) each."""

    body: str
    moment: FloatArray
    force: FloatArray
    follows: bool = False


def equilibrium(
    chain: Chain,
    loads: list[Load],
    gravity: FloatArray | None = None,
    rounds: int = 200,
    control: FloatArray | None = None,
) -> Batch:
    """Return B chains at rest under their loads, with fresh kinematics."""
    count = len(loads[0].force)
    batch = Batch(relaxed(chain.model), count, 2)
    for name in ("xpos", "xmat", "xquat", "ten_length"):
        batch.bind(name)
    if gravity is not None:
        batch.expand("opt.gravity")[:] = gravity
    if control is not None:
        batch.bind("ctrl")[:] = control
    wrench = batch.bind("xfrc_applied")
    ids = [chain.model.body(load.body).id for load in loads]
    velocity = batch.bind("qvel")
    with QuietEngine():
        batch.forward()
        for turn in range(rounds):
            for load, body in zip(loads, ids, strict=True):
                frame = batch.xmat[:, body].reshape(-1, 3, 3)
                if not load.follows:
                    frame = np.broadcast_to(np.eye(3), frame.shape)
                share = min(1.0, (turn + 1) / 20)  # loads grow, so that no rod jumps
                wrench[:, body, :3] = share * np.einsum("bij,bj->bi", frame, load.force)
                wrench[:, body, 3:] = share * np.einsum("bij,bj->bi", frame, load.moment)
            batch.step(nstep=2, stage=int(mujoco.mjtStage.mjSTAGE_POS))
            if turn > 30 and np.abs(velocity).max() < 1e-5:
                break
    return batch


def read_statics(path: Path) -> dict[str, FloatArray]:
    """Return the shapes of a SoRoSim statics file in a z-up frame.

    Returns
    -------
    dict
        `gravity`, `mid_moment`, `mid_force`, `tip_moment`, `tip_force` (B, 3) and `points`
        (B, 14, 3) [m] at `stations` (14,), as a fraction of the length.
    """
    with path.open() as file:
        rows = list(csv.reader(file))
    numbers = np.array([[float(cell) for cell in row[1:]] for row in rows[1:]])
    stations = numbers[0, 3:].copy()
    split = float(numbers[0, 2])
    shapes = numbers[1:].reshape(-1, 6, numbers.shape[1])

    def vectors(block: FloatArray) -> FloatArray:
        return block @ TO_Z_UP.T

    points = np.stack([vectors(shapes[:, 3:, 3 + i]) for i in range(len(stations))], axis=1)
    return {
        "gravity": vectors(shapes[:, 3:, 0]),
        "mid_moment": vectors(shapes[:, :3, 1]),
        "mid_force": vectors(shapes[:, 3:, 1]),
        "tip_moment": vectors(shapes[:, :3, 2]),
        "tip_force": vectors(shapes[:, 3:, 2]),
        "points": points,
        "header": np.array([numbers[0, 1], split]),
        "stations": stations,
    }
