"""Diagnostics of runs in the report."""

import numpy as np
import pytest

from agents.reporting import plots
from agents.reporting.inside import LABELS, load_inside, read_inside
from agents.reporting.loading import load_study
from agents.reporting.report import write_report
from agents.reporting.results import ResultsError
from agents.reporting.summary import summarise


def diagnose(folder):
    for i, run in enumerate(sorted(folder.glob("*/seed_*"))):
        steps = np.arange(1, 101) * 2000
        np.savez(
            run / "diagnostics.npz", env_steps=steps, noise_on=np.full(100, i), approx_kl=steps
        )


def test_means_over_seeds_are_shown_and_read_back(make_study):
    folder = make_study({"n = 3": {"raw": 1.0, "clarke": 1.5}}, 3)
    write_report(folder, reps=20, kinds=("png",))
    assert not (folder / "report" / "inside.png").exists()
    diagnose(folder)
    write_report(folder, reps=20, kinds=("png",))
    assert (folder / "report" / "inside.png").exists()
    clarke, raw = sorted(
        read_inside(folder / "report" / "diagnostics.csv"), key=lambda row: row.representation
    )
    assert (clarke.representation, raw.representation) == ("clarke", "raw")
    np.testing.assert_allclose(clarke.values["noise_on"], 1.0)  # folders in the order of names
    np.testing.assert_allclose(raw.values["noise_on"], 4.0)
    assert raw.env_steps[[0, -1]].tolist() == [2000, 200_000]
    assert "clip_fraction" in LABELS
    assert "clip_fraction" not in raw.values


def test_a_damaged_file_is_said(make_study):
    folder = make_study({"n = 3": {"raw": 1.0}}, 1)
    (folder / "raw_0" / "seed_00" / "diagnostics.npz").write_bytes(b"no")
    with pytest.raises(ResultsError, match=r"diagnostics\.npz: cannot be read"):
        load_inside(load_study(folder))


def test_the_figure_has_a_row_for_what_is_known_and_older_tables_are_read(make_study, tmp_path):
    folder = make_study({"n = 3": {"raw": 1.0, "clarke": 1.5}}, 2)
    diagnose(folder)
    summary = summarise(load_study(folder), seed=0, reps=20)
    axes = plots.inside(summary, "").axes
    assert [ax.get_ylabel() for ax in axes] == [LABELS["noise_on"], LABELS["approx_kl"]]
    table = tmp_path / "diagnostics.csv"
    table.write_text("task,representation,env_steps,noise_on\nt,raw,10,0.5\nt,raw,20,0.25\n")
    (row,) = read_inside(table)
    assert row.values["noise_on"].tolist() == [0.5, 0.25]
    assert set(row.values) == {"noise_on"}


def test_studies_whose_quantities_are_not_drawn_have_a_report(make_study):
    """What SAC writes has a temperature; another learner may write nothing that is known."""
    folder = make_study({"n = 3": {"raw": 1.0, "clarke": 1.5}}, 2)
    for values, drawn in (({"loss": np.ones(3)}, False), ({"ent_coef": np.ones(3)}, True)):
        for run in folder.glob("*/seed_*"):
            np.savez(run / "diagnostics.npz", env_steps=np.arange(3) * 2000, **values)
        write_report(folder, reps=20, kinds=("png",))
        assert (folder / "report" / "inside.png").exists() == drawn
