"""The published accuracy, on a part of the reference data, where that data is present."""

from pathlib import Path

import numpy as np
import pytest

matplotlib = pytest.importorskip("matplotlib")

from benchmarks.validation import cosserat, release, statics  # noqa: E402
from benchmarks.validation.common import REFERENCE, Skipped, reference  # noqa: E402
from benchmarks.validation.rod import RODS, read_statics  # noqa: E402

present = pytest.mark.skipif(not REFERENCE.exists(), reason=f"no reference data at {REFERENCE}")


@present
def test_accurate_profile_agrees_with_cosserat_rods(tmp_path):
    rows = [row for row in cosserat.run(tmp_path) if row.bar is not None]
    assert len(rows) == 2
    assert all(row.verdict == "met" for row in rows)


@present
@pytest.mark.parametrize("rod", RODS, ids=lambda rod: rod.name)
def test_wrench_loaded_rods_agree_with_sorosim(rod):
    shapes = read_statics(reference("sorosim", rod.statics))
    some = {name: values[::20] for name, values in shapes.items() if len(values) == 400}
    assert statics.tip_errors(rod, some, 24).mean() < statics.LINKS[24]


@present
def test_released_rods_swing_as_sorosim_says(monkeypatch):
    monkeypatch.setattr(release, "DURATION_S", 0.5)
    rod = RODS[0]
    files = sorted(reference("sorosim", "dynamics").glob(f"{rod.dynamics}*.txt"))[:2]
    data = [release.read_release(file) for file in files]
    damping, gravity, wrenches, paths = (np.array(part) for part in zip(*data, strict=True))
    reached = release.simulate(rod, damping, gravity, wrenches, 6)
    rms = np.sqrt(((reached - paths) ** 2).sum(-1).mean(1)) / rod.length_m
    assert (rms < 0.015).all()


def test_absent_data_is_skipped_with_its_place():
    with pytest.raises(Skipped, match="no reference data at"):
        reference("nowhere", str(Path("missing.csv")))
