"""Speed of the transform and of the kinematics against bare NumPy, as ratios inside one run.

python -m benchmarks.transform_speed
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np

from benchmarks.timing import Workload, seconds_per_call
from clarke_gym.clarke import to_clarke, transform_matrix
from clarke_gym.kinematics import segment_pose

ROWS = 1_000_000
TENDONS = 11


def main() -> None:
    """Print both ratios with their bars."""
    rng = np.random.default_rng(0)
    rho = rng.uniform(-1.0, 1.0, (ROWS, TENDONS))
    bending = rng.uniform(-2.0, 2.0, (ROWS, 2))
    matrix = transform_matrix(TENDONS).T
    work: dict[str, Workload] = {
        "bare product": lambda: rho @ matrix,
        "to_clarke": lambda: to_clarke(rho),
        "sin and cos": lambda: (np.sin(bending), np.cos(bending)),
        "segment_pose": lambda: segment_pose(bending, 0.2),
    }
    seconds = seconds_per_call(work, rounds=9, calls=1)
    for name, value in seconds.items():
        print(f"{name:14s} {1e3 * value:8.1f} ms")
    for name, base, bar in (
        ("to_clarke", "bare product", 1.3),
        ("segment_pose", "sin and cos", 3.0),
    ):
        ratio = seconds[name] / seconds[base]
        print(f"{name} / {base}: {ratio:.2f} (bar {bar})")


if __name__ == "__main__":
    main()
