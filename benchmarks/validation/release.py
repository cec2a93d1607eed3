"""(d) Tip-release dynamics against SoRoSim: tip path and first frequency.

The first number of a file is taken for the ratio of viscous to elastic moduli [s].
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from mujoco.batch import Batch

from benchmarks.validation.common import Row, reference, save
from benchmarks.validation.rod import RODS, TO_Z_UP, Load, RodSpec, equilibrium, rod_chain
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.mujoco.links import MIN_DAMPING_TIME_S
from clarke_gym.physics.mujoco.model import PROFILES, substeps

SAMPLE_S = 5e-3
DURATION_S = 10.0
BARS = {"path": 1.5, "frequency": 2.0}  # % of length, %


def read_release(path: Path) -> tuple[float, FloatArray, FloatArray, FloatArray]:
    """Return damping time [s], gravity (3,), wrenches (4, 3) and tip path (T, 3), z up."""
    lines = path.read_text().split("\n")
    head, hold = ([float(cell) for cell in line.split()] for line in lines[:2])
    samples = np.array([[float(c) for c in line.split()] for line in lines[2:] if line.strip()])
    wrenches = np.array(hold[1:]).reshape(4, 3) @ TO_Z_UP.T
    count = round(DURATION_S / SAMPLE_S) + 1
    return head[0], TO_Z_UP @ head[-3:], wrenches, samples[:count, -3:] @ TO_Z_UP.T


def time_step_s() -> float:
    """Return the longest step of the accurate profile that divides the sampling time [s]."""
    return SAMPLE_S / substeps(SAMPLE_S, None, PROFILES["accurate"].sim_dt_s)


def simulate(
    rod: RodSpec, damping: FloatArray, gravity: FloatArray, wrenches: FloatArray, elements: int
) -> FloatArray:
    """Return the tip paths after the release [m], shape (B, T, 3)."""
    step = time_step_s()
    chain = rod_chain(rod, elements, sim_dt_s=step, damping_time_s=0.0)
    model = chain.model
    loads = [
        Load("end0", wrenches[:, 0], wrenches[:, 1]),
        Load("end1", wrenches[:, 2], wrenches[:, 3]),
    ]
    held = equilibrium(chain, loads, gravity)
    model.opt.timestep = step
    batch = Batch(model, len(damping), 2)
    batch.expand("opt.gravity")[:] = gravity
    tau = np.maximum(MIN_DAMPING_TIME_S, damping - step)[:, None]
    batch.expand("dof_damping")[:] = tau * model.jnt_stiffness
    batch.bind("qpos")[:] = held.bind("qpos")
    points = batch.bind("xpos")
    batch.forward()
    tip = model.body("end1").id
    path = [points[:, tip].copy()]
    for _ in range(round(DURATION_S / SAMPLE_S)):
        batch.step(nstep=round(SAMPLE_S / step), stage=1)
        path.append(points[:, tip].copy())
    return np.stack(path, axis=1)


def first_frequency(path: FloatArray) -> float:
    """Return the strongest frequency of a tip path (T, 3) [Hz]."""
    signal = path - path.mean(0)
    signal = signal @ np.linalg.svd(signal, full_matrices=False)[2][0]
    size = 64 * len(signal)
    spectrum = np.abs(np.fft.rfft(signal * np.hanning(len(signal)), size))
    spectrum[: int(0.5 * size * SAMPLE_S)] = 0.0  # settling is no vibration
    return float(np.fft.rfftfreq(size, SAMPLE_S)[spectrum.argmax()])


def run(out: Path) -> list[Row]:
    """Release every rod of both materials."""
    rows = []
    figure = Figure((8.0, 3.5))
    axes = figure.subplots(1, 2)
    for axis, rod in zip(axes, RODS, strict=True):
        files = sorted(reference("sorosim", "dynamics").glob(f"{rod.dynamics}*.txt"))
        data = [read_release(file) for file in files]
        damping, gravity, wrenches, paths = (np.array(part) for part in zip(*data, strict=True))
        reached = simulate(rod, damping, gravity, wrenches, 12)
        rms = np.sqrt(((reached - paths) ** 2).sum(-1).mean(1)) / rod.length_m * 100.0
        ratio = [
            abs(first_frequency(ours) / first_frequency(theirs) - 1.0) * 100.0
            for ours, theirs in zip(reached, paths, strict=True)
        ]
        step = 1e3 * time_step_s()
        conditions = (
            f"{rod.name}, {len(files)} releases, {DURATION_S:g} s, 48 joints, {step:.3g} ms"
        )
        for name, value in (("mean", rms.mean()), ("worst", rms.max())):
            case = f"{name} tip path RMS"
            rows.append(Row("release", case, conditions, float(value), "% L", BARS["path"]))
        case = "worst error of the first frequency"
        rows.append(Row("release", case, conditions, max(ratio), "%", BARS["frequency"]))
        time = SAMPLE_S * np.arange(paths.shape[1])
        for label, path in (("SoRoSim", paths[0]), ("MuJoCo", reached[0])):
            axis.plot(time, 1e3 * path[:, 0], label=label, linewidth=1.0)
        axis.set(title=rod.name, xlabel="time [s]", ylabel="tip x [mm]")
    axes[0].legend()
    save(figure, out, "release")
    return rows
