"""What users had before the rooms were rebuilt, held to 1e-6."""

import numpy as np
import pytest

from tests.regression.trajectories import FILE, cases, roll

CASES = dict(cases())
RECORDED = np.load(FILE)


def test_every_case_is_recorded():
    assert sorted(RECORDED.files) == sorted(CASES)


@pytest.mark.parametrize("name", CASES)
def test_trajectories_are_those_recorded(name):
    np.testing.assert_allclose(roll(name, CASES[name]), RECORDED[name], rtol=0.0, atol=1e-6)
