"""Robot descriptions: validation, layouts and presets."""

import math

import numpy as np
import pytest

from clarke_gym.clarke import inverse_matrix, transform_matrix
from clarke_gym.robots import Robot, Segment
from clarke_gym.robots.presets import HOLDING_LENGTH_M, PRESETS, make_robot


@pytest.mark.parametrize("n", [3, 7, 11])
def test_symmetric_segment_has_the_clarke_matrices(n):
    encoder, decoder = Segment(n_tendons=n).matrices
    np.testing.assert_allclose(encoder, transform_matrix(n), atol=1e-15)
    np.testing.assert_allclose(decoder, inverse_matrix(n), atol=1e-15)


def test_segments_may_have_different_numbers_of_tendons():
    robot = Robot((Segment(n_tendons=3), Segment(n_tendons=5, pitch_radius_m=0.008)))
    assert robot.n_joints == 8
    np.testing.assert_allclose(robot.encoder @ robot.decoder, np.eye(4), atol=1e-14)
    assert not robot.encoder[:2, 3:].any()


def test_default_robot_has_the_published_dimensions():
    segment = make_robot().segments[0]
    assert (segment.length_m, segment.pitch_radius_m) == (0.2, 0.01)
    assert segment.backbone_diameter_m == 1.4e-3
    assert segment.max_bending_rad == math.pi / 2


@pytest.mark.parametrize("name", sorted(PRESETS))
def test_presets_are_complete(name):
    robot = PRESETS[name]
    assert robot.name == name
    assert robot.length_m == pytest.approx(robot.lengths.sum())
    np.testing.assert_allclose(
        robot.encoder @ robot.decoder, np.eye(2 * robot.n_segments), atol=1e-12
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"n_tendons": 2}, "n_tendons must be at least 3, got 2"),
        ({"length_m": 0.0}, "length_m must be a positive finite number, got 0.0"),
        ({"length_m": math.nan}, "length_m"),
        ({"pitch_radius_m": math.inf}, "pitch_radius_m"),
        ({"max_bending_rad": 7.0}, "below 2 pi"),
        ({"tendon_angles_rad": (0.0, 1.0)}, "n_tendons=3 numbers, got 2"),
        ({"tendon_angles_rad": 5}, "tendon_angles_rad must hold n_tendons=3 numbers, got 5"),
        ({"tendon_angles_rad": (0.0, 0.0, math.pi)}, "collinear"),
        ({"n_disks": 0}, "n_disks"),
    ],
)
def test_impossible_segments_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Segment(**arguments)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"robot": "octopus"}, r"robot must be one of \['default'"),
        ({"n_segments": 0}, "n_segments must be a whole number >= 1, got 0"),
        ({"n_segments": True}, "n_segments must be a whole number >= 1, got True"),
        ({"robot": "hardware", "n_segments": 2}, "needs equal segments"),
        ({"segment_length_m": -1.0}, "length_m"),
    ],
)
def test_impossible_robots_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        make_robot(**arguments)


def test_overrides_reach_every_segment_and_keep_the_first_tendon():
    robot = make_robot("two_segment", n_tendons=6, pitch_radius_m=0.008)
    assert robot.n_tendons == (6, 6)
    assert robot.segments[1].angles[0] == pytest.approx(math.pi / 2)
    assert robot.segments[0].radii.tolist() == [0.008] * 6


def test_a_robot_with_radii_of_its_own_keeps_them():
    robot = Robot((Segment(tendon_radii_m=(0.01, 0.012, 0.009)),))
    with pytest.raises(ValueError, match="would lose where the tendons of robot 'custom' are"):
        make_robot(robot, pitch_radius_m=0.01)
    assert make_robot(robot, max_bending_rad=1.0).segments[0].radii.tolist() == [0.01, 0.012, 0.009]


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        ({"tendon_radii_m": [10, 12, 9]}, "0.0001 to 0.5 m, got .*another unit"),
        ({"tendon_angles_rad": [90, 210, 330]}, "rad, got .*another unit"),
        ({"tendon_angles_rad": [0.0, 2.0, "x"]}, "must be numbers from"),
        ({"tendon_angles_rad": 5}, "must be a list of numbers, got 5"),
    ],
)
def test_layouts_in_another_unit_are_told(segment, message):
    with pytest.raises(ValueError, match=message):
        make_robot({"segments": [segment]})
    assert make_robot({"segments": [{"tendon_radii_m": None}]}).n_joints == 3
    angles = np.linspace(0.0, 2.0 * np.pi, 5)[:-1]
    for given in (angles, list(angles.astype(np.float32))):
        described = {"segments": [{"n_tendons": 4, "tendon_angles_rad": given}]}
        assert make_robot(described).segments[0].angles == pytest.approx(angles, abs=1e-6)


def test_descriptions_are_frozen():
    with pytest.raises(AttributeError):
        make_robot().segments[0].length_m = 1.0


def test_segments_share_the_length_that_the_backbone_holds_up():
    assert make_robot(n_segments=2).lengths.tolist() == [0.2, 0.2]
    assert make_robot(n_segments=5).length_m == pytest.approx(0.4)
    assert make_robot(n_segments=5).segments[0].pretension_n == pytest.approx(25.0)
    long = make_robot(n_segments=5, segment_length_m=0.2)
    assert long.length_m == pytest.approx(1.0)
    assert long.segments[0].pretension_n == 10.0
    robot = make_robot()
    segment = robot.segments[0]
    radius = segment.backbone_diameter_m / 2.0
    stiffness = segment.youngs_modulus_pa * np.pi * radius**4 / 4.0
    mass = segment.density_kg_m3 * np.pi * radius**2
    mass += segment.n_disks * segment.disk_mass_kg / segment.length_m
    held = (stiffness / (9.80665 * mass)) ** (1.0 / 3.0)
    assert held == pytest.approx(HOLDING_LENGTH_M, rel=0.1)
