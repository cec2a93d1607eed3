"""Where plain Clarke coordinates end, and what repairs them: docs/limits.md.

python -m benchmarks.limits

Robots whose tendons are not where everybody thinks, on constant curvature. A controller without
feedback sends the tendons to a goal's shape by three decoders: that of the nominal ring (plain
Clarke), that of the true layout (`clarke_layout`), and one fitted to recorded commands and shapes
(the two leading directions a segment of a least-squares map: an SVD basis).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from clarke_gym import kinematics
from clarke_gym.disturbances import DISTURBANCES
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.representations import clarke_layout
from clarke_gym.robots import make_robot

PAGE = Path(__file__).resolve().parent.parent / "docs" / "limits.md"
FLAWS = ("misplacement", "unequal_radii", "helical", "broken_tendon", "slack_tendon")
ROBOTS, GOALS, RECORDED = 40, 50, 100
NOISE_M = 2e-5
"""Noise of recorded shapes, as Clarke coordinates [m]."""


def errors(flaw: str, n: int) -> dict[str, FloatArray]:
    """Return tip errors [% of length] by decoder, shape (robots, goals)."""
    robot, rng = make_robot(n_tendons=n), np.random.default_rng(0)
    segment = robot.segments[0]
    made = DISTURBANCES[flaw](robot, ROBOTS)
    numbers = rng.random((ROBOTS, made.numbers))
    made.begin(np.arange(ROBOTS), numbers, np.zeros((ROBOTS, n)))
    shapes = kinematics.sample_dome(rng.random((GOALS, 1, 2)), robot.max_bending)
    goals = kinematics.bending_to_clarke(shapes, robot.pitch_radii).reshape(GOALS, 2)
    tips = kinematics.forward(shapes, robot.lengths)[0]

    def reached(commands: FloatArray) -> FloatArray:
        """Return the Clarke coordinates that commands (ROBOTS, K, N) lead to."""
        told = [made.step(np.ascontiguousarray(commands[:, k])) for k in range(commands.shape[1])]
        return np.stack(told, 1) @ robot.encoder.T

    decoders = {"plain Clarke": np.tile(segment.matrices[1], (ROBOTS, 1, 1))}
    if hasattr(made, "layout"):
        angles, radii = made.layout(numbers)
        if (radii > 0.0).all():
            true = [clarke_layout(a, r)(segment)[0] for a, r in zip(angles, radii, strict=True)]
        else:  # no layout has a tendon at no distance; the least-squares decoder does
            own = (radii / segment.pitch_radius_m)[..., None] * np.stack(
                [np.cos(angles), np.sin(angles)], -1
            )
            true = list(own)
        decoders["true layout"] = np.stack(true)
    tried = rng.normal(size=(ROBOTS, RECORDED, n)) * 0.3 * robot.max_clarke[0]
    seen = reached(tried) + NOISE_M * rng.standard_normal((ROBOTS, RECORDED, 2))
    fitted = [np.linalg.lstsq(a, b, rcond=None)[0] for a, b in zip(tried, seen, strict=True)]
    decoders["SVD of data"] = np.stack([np.linalg.pinv(matrix.T) for matrix in fitted])
    found = {}
    for name, decoder in decoders.items():
        clarke = reached(np.einsum("rnk,gk->rgn", decoder, goals)).reshape(-1, 1, 2)
        bending = kinematics.clarke_to_bending(clarke, robot.pitch_radii)
        at = kinematics.forward(bending, robot.lengths)[0].reshape(ROBOTS, GOALS, 3)
        found[name] = 100.0 * np.linalg.norm(at - tips, axis=-1) / robot.length_m
    return found


def page() -> str:
    """Return the page as Markdown."""
    rows = []
    for flaw in FLAWS:
        for n in (4, 8):
            found = errors(flaw, n)
            cells = [
                f"{np.median(found[name]):.2f} / {found[name].max():.2f}" if name in found else "–"
                for name in ("plain Clarke", "true layout", "SVD of data")
            ]
            rows.append(f"| `{flaw}` | {n} | " + " | ".join(cells) + " |")
    return _TEXT.format(rows="\n".join(rows), robots=ROBOTS, goals=GOALS, recorded=RECORDED)


_TEXT = """# Where plain Clarke coordinates end

Tip error in % of the length, median and worst of {robots} robots with {goals} goals each, one
segment, constant curvature, no feedback: the command is the goal's shape through a decoder. Plain:
that of the nominal ring. True layout: `clarke_gym.representations.clarke_layout(angles, radii)`,
for those who know where the tendons are. SVD of data: fitted to {recorded} recorded commands and
shapes (noise 20 um). Flaws at full strength, as in [the list](sensors.md).
`python -m benchmarks.limits` writes this page.

| flaw | n | plain Clarke | true layout | SVD of data |
|---|---|---|---|---|
{rows}

A layout that is off is a linear matter: who knows it, or has recorded data, has it back. More
tendons average misplaced holes out. A broken tendon costs nothing as long as the others may push as
well as pull, as constant curvature has it; real tendons of which one is missing cannot bend the
robot away from it. It has no layout either: that column is the least-squares decoder of those that
are left. Slack is an offset, which no linear decoder sees: feedback of the tip takes it away. A
helix is here what it does to the mean bend; that the real backbone leaves the arc is not simulated.
It is in MuJoCo: of what parallel tendons would do, the summed bend comes out sinc(tau/2) there
where it is 1/sinc(tau/2) here, both turned by tau/2.

In an environment commands of a layout that is not the description's leave its manifold, and what
leaves it is held within `max_cocontraction_m` (0.2 mm by default): give it room, 5 mm for these
flaws, where actions are in `clarke_layout`. Classical controllers read and write in the
description's layout, so they are for `raw` and the representations of its manifold.
"""


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE.read_text())
