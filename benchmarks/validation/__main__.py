"""Command line: ``python -m benchmarks.validation [--only bend ...] [--out folder]``."""

from __future__ import annotations

import argparse
import csv
import importlib
import time
from pathlib import Path

from benchmarks.validation.common import Skipped, markdown, read

PARTS = {
    "bend": "displacement to bending angle",
    "cosserat": "tendon-driven robots against Cosserat rods",
    "statics": "wrench-loaded rods against SoRoSim",
    "release": "tip-release dynamics against SoRoSim",
    "beam": "Euler-Bernoulli deflection and first frequency",
    "gap": "constant curvature against MuJoCo",
    "hardware": "a real three-segment robot",
    "hardware_mujoco": "the same with MuJoCo's model and the identified numbers",
    "motion": "tip paths against a time step of 0.1 ms, taut and slack",
}


def main() -> None:
    """Run the chosen parts, and write the table of all beside the figures."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.validation", description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(PARTS), help="parts to run (all)")
    parser.add_argument("--out", type=Path, default=Path("docs/validation"), help="output folder")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    table = options.out / "results.csv"
    found = {name: [row for row in read(table) if row.part == name] for name in PARTS}
    for name in options.only or PARTS:
        start = time.perf_counter()
        try:
            found[name] = importlib.import_module(f"benchmarks.validation.{name}").run(options.out)
        except Skipped as reason:
            print(f"{name}: skipped, {reason}")
            continue
        print(f"{name}: {PARTS[name]}, {time.perf_counter() - start:.0f} s")
    rows = [row for name in PARTS for row in found[name]]
    print(markdown([row for row in rows if row.part in (options.only or PARTS)]))
    (options.out / "results.md").write_text(markdown(rows))
    with table.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["part", "case", "conditions", "value", "unit", "bar", "verdict"])
        writer.writerows(
            [r.part, r.case, r.conditions, f"{r.value:.6g}", r.unit, r.bar, r.verdict] for r in rows
        )


if __name__ == "__main__":
    main()
