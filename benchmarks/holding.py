"""What co-contraction, many tendons and friction do for stiffness: docs/validation/holding.md.

python -m benchmarks.holding

A force on the tip of the default robot, straight and bent, on MuJoCo: how far the tip gives way to
a slow force and to a push of 0.2 s, for 3, 4 and 8 tendons, four co-contractions, with the
pretension of the preset and nearly without, and with capstan friction.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np

from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot, make_robot
from clarke_gym.robots.joint_vector import JointVector

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "validation"
FORCE_N = 0.1
TENDONS = (3, 4, 8)
COCONTRACTION = (0.0, 0.25, 0.5, 1.0)
PRETENSIONS_N = (10.0, 0.5)
FRICTION = (0.0, 0.2, 0.4)


def gave_way(
    robot: Robot, share: float, bend_rad: float, steps: int, friction: float = 0.0
) -> float:
    """Return how far the tip is from where it was after a force of some steps [m]."""
    physics = MujocoPhysics(robot, 1, 0.05, profile="accurate")
    if friction:
        physics.vary(np.array([0]), {"friction": np.array([friction])})
    clarke = np.zeros((1, robot.n_segments, 2))
    clarke[0, :, 0] = 0.01 * bend_rad
    off = np.full((robot.n_joints, 1), share * robot.max_cocontraction_m)
    command = JointVector([np.array([part]) for part in clarke.reshape(-1)], off)
    physics.reset(np.array([0]), clarke)
    for _ in range(40):
        physics.step(command)
    before = physics.state.tip_position.copy()
    physics.pull(np.array([[0.0, FORCE_N, 0.0]]))
    for _ in range(steps):
        physics.step(command)
    return float(np.linalg.norm(physics.state.tip_position - before))


def main() -> None:
    """Write the page and its figure."""
    found = {}
    for pretension in PRETENSIONS_N:
        for n in TENDONS:
            plain = make_robot(n_tendons=n)
            robot = Robot(
                tuple(replace(segment, pretension_n=pretension) for segment in plain.segments)
            )
            for share in COCONTRACTION:
                for name, bend, steps in (
                    ("slow, straight", 0.0, 40),
                    ("slow, bent 1 rad", 1.0, 40),
                    ("push, straight", 0.0, 4),
                ):
                    found[pretension, n, share, name] = gave_way(robot, share, bend, steps)
    parts, cut = [], []
    for count in (1, 2, 3):
        robot = make_robot(n_tendons=4, n_segments=count, segment_length_m=0.2 / count)
        first, last = (gave_way(robot, share, 0.0, 40) for share in (0.0, 1.0))
        cut.append(first)
        parts.append(f"| {count} | {1e3 * first:.3f} | {100.0 * (last / first - 1.0):+.2f} % |")
    robot, rubbing = make_robot(n_tendons=4), []
    for friction in FRICTION:
        cells = []
        for bend in (0.0, 1.0):
            first, last = (gave_way(robot, share, bend, 40, friction) for share in (0.0, 1.0))
            cells.append(f"{1e3 * first:.3f} | {100.0 * (last / first - 1.0):+.2f} %")
        rubbing.append(f"| {friction:g} | " + " | ".join(cells) + " |")
    figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2), sharey=True)
    for n, style in zip(TENDONS, ("o-", "s--", "^:"), strict=True):
        values = [1e3 * found[10.0, n, share, "slow, straight"] for share in COCONTRACTION]
        left.plot([0.2 * share for share in COCONTRACTION], values, style, label=f"n = {n}")
    left.set_xlabel("co-contraction [mm]")
    left.set_ylabel(f"tip gives way to {FORCE_N:g} N [mm]")
    left.set_ylim(0.0, 8.0)
    left.legend(frameon=False, loc="center")
    counts = np.arange(1, len(cut) + 1)
    right.plot(counts, 1e3 * np.array(cut), "o", label="measured")
    right.plot(counts, 1e3 * cut[0] / counts**2, "k:", label="1 / segments²")
    right.set_xticks(counts)
    right.set_xlabel("segments of the same 0.2 m")
    right.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(FOLDER / "holding.png", dpi=120)
    names = ("slow, straight", "slow, bent 1 rad", "push, straight")
    rows = []
    for pretension in PRETENSIONS_N:
        for n in TENDONS:
            cells = []
            for name in names:
                first, last = (found[pretension, n, share, name] for share in (0.0, 1.0))
                cells.append(f"{1e3 * first:.3f} | {100.0 * (last / first - 1.0):+.2f} %")
            rows.append(f"| {pretension:g} | {n} | " + " | ".join(cells) + " |")
    (FOLDER / "holding.md").write_text(
        _TEXT.format(
            force=FORCE_N,
            rows="\n".join(rows),
            parts="\n".join(parts),
            rubbing="\n".join(rubbing),
        )
    )
    print("\n".join(rows + parts + rubbing))


_TEXT = """# Does co-contraction stiffen a tendon-driven segment?

A force of {force} N across the tip of the default robot on MuJoCo (`accurate`): how far the tip
gives way without co-contraction [mm], and how that changes with all of it (0.2 mm more on every
tendon), for a slow force on the straight and on the bent robot and for a push of 0.2 s. `python
-m benchmarks.holding` writes this page.

![stiffness against co-contraction](holding.png)

| pretension [N] | n | slow, straight | change | bent 1 rad | change | push, straight | change |
|---|---|---|---|---|---|---|---|
{rows}

Ideal parallel tendons hold the bend summed over a segment and nothing else: a force across the
tip bends the backbone into an S whose sum is nought, and no tendon feels it. So neither their
number nor their common tension changes what the tip gives way, as long as all stay taut. Two
Clarke coordinates lose nothing here that `raw` or `clarke_common` could use; where tendons go
slack, common tension keeps them from it, and that is all it does.

What does stiffen the robot is where tendons end. The same 0.2 m with the same four tendons a
segment, cut into segments whose tendons end at disks between:

| segments | slow, straight | change |
|---|---|---|
{parts}

Friction that grows with tension, as the disturbance `capstan` has it, with four tendons and the
coefficients mu:

| mu | slow, straight | change | bent 1 rad | change |
|---|---|---|---|---|
{rubbing}

It holds the end of each tendon, which hardly moves here, and the backbone bends past it; so
co-contraction cannot use it. What tendons would hold at each disk that they rub on is not in this
model.
"""


if __name__ == "__main__":
    main()
