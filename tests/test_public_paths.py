"""Import paths that users were shown keep working."""

import importlib

import pytest

SHOWN_BY_0_1 = [
    ("clarke", "to_clarke"),
    ("kinematics", "segment_pose"),
    ("layouts", "map_design"),
    ("modes", "mode_energy"),
    ("presets", "make_robot"),
    ("representations", "representation_names"),
    ("robots", "Robot"),
    ("sampling", "sample_disk"),
    ("spaces", "SpaceChain"),
    ("tension", "distribute"),
    ("trajectories", "Trajectory"),
    ("wrappers", "ClarkeAction"),
    ("wrappers.vector", "ClarkeObservation"),
]


@pytest.mark.parametrize(("module", "name"), SHOWN_BY_0_1)
def test_paths_of_0_1_give_the_same_objects(module, name):
    found = getattr(importlib.import_module(f"clarke_gym.{module}"), name)
    home = importlib.import_module(found.__module__)
    assert getattr(home, name) is found
