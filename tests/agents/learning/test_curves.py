"""What is shipped has been shown to learn: a committed curve for each configuration."""

import csv

import pytest

from agents.files import ROOT
from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import TrainConfig, load_config

CURVES = ROOT / "docs" / "curves"
SOLVED = ("reach", "pose", "track", "shape", "gate", "hold")
TRAINS = sorted((ROOT / "configs" / "train").glob("*.yaml"))


@pytest.mark.parametrize("path", TRAINS, ids=lambda path: path.stem)
def test_every_shipped_run_has_its_curve(path):
    with (CURVES / f"{path.stem}.csv").open() as file:
        last = list(csv.DictReader(file))[-1]
    assert int(last["env_steps"]) == load_config(TrainConfig, path).total_steps
    assert float(last["wall_s"]) > 0
    if path.stem.split("_")[0] in SOLVED:  # what the others reach is the honest best
        assert float(last["success_rate"]) >= 0.9


def test_no_algorithm_is_shipped_without_a_curve():
    shown = {load_config(TrainConfig, path).algo.name for path in TRAINS}
    for name in ALGORITHMS.keys() - shown:
        with (CURVES / f"{name}.csv").open() as file:
            assert float(list(csv.DictReader(file))[-1]["success_rate"]) >= 0.9, name
    shipped = {path.stem for path in (ROOT / "configs" / "algos").glob("*.yaml")}
    assert shipped == set(ALGORITHMS)


def test_the_page_says_what_the_curves_say():
    page = (ROOT / "docs" / "reliability.md").read_text().split("| configuration |")[1]
    lines = [line.split("|")[1:-1] for line in page.split("\n\n")[0].splitlines()[2:]]
    told = {cells[0].split("`")[1].removeprefix("algo: "): cells[1:4] for cells in lines}
    assert told.keys() >= {path.stem for path in TRAINS}
    for name, cells in told.items():
        with (CURVES / f"{name}.csv").open() as file:
            rows = [
                (int(row["env_steps"]), float(row["success_rate"])) for row in csv.DictReader(file)
            ]
        reached = [f"{steps:,}" for steps, success in rows if success >= 0.9]
        expected = [f"{rows[-1][0]:,}", f"{rows[-1][1]:.2f}", (reached or ["not reached"])[0]]
        assert [cell.strip() for cell in cells] == expected, name
