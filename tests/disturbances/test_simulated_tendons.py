"""Tendons of one's own in MuJoCo, against models compiled with them, statics and formulas."""

from dataclasses import replace
from xml.etree import ElementTree

import gymnasium as gym
import mujoco
import numpy as np
import pytest

from clarke_gym.disturbances import DISTURBANCES
from clarke_gym.numerics.batch import One
from clarke_gym.physics.mjcf import mjcf
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.physics.mujoco.model import PROFILES, build_chain
from clarke_gym.physics.mujoco.rest import resting
from clarke_gym.physics.mujoco.tendons import tendon_offsets
from clarke_gym.physics.statics import taut_gain
from clarke_gym.robots import Robot, make_robot
from clarke_gym.robots.joint_vector import JointVector

WEIGHTLESS = {"gravity_m_s2": (0.0, 0.0, 0.0)}


def moved(robot, batch, vary=None, off=None, steps=20, clarke=(0.006, 0.002), **keywords):
    """Return physics after a move from one bend to another."""
    physics = MujocoPhysics(robot, batch, 0.05, **keywords)
    rows = np.arange(physics.batch.size)
    if vary is not None:
        physics.vary(rows, vary)
    many = (len(rows), robot.n_segments, 1)
    physics.reset(rows, np.tile([[0.003, 0.001]], many))
    off = None if off is None else np.tile(off, (len(rows), 1))
    command = JointVector.from_clarke(np.tile([clarke], many), off, physics.batch)
    for _ in range(steps):
        physics.step(command)
    return physics


def settled_bends(physics):
    """Return the bends summed to each segment's end, (B, 2S) [rad]."""
    return physics._engine.qpos @ physics.chain.bending_sum.T


@pytest.mark.parametrize("off", [None, (2e-4, -1e-4, -1e-4)], ids=["taut", "slack"])
@pytest.mark.parametrize("name", ["default", "two_segment", "hardware"])
def test_stiffness_and_pretension_are_those_of_a_model_compiled_with_them(name, off):
    robot = make_robot(name)
    count, off = robot.n_segments, None if off is None else np.resize(off, robot.n_joints)
    softer, looser = np.linspace(0.1, 0.3, count), np.linspace(0.4, 0.2, count)
    compiled = Robot(
        tuple(
            replace(
                segment,
                tendon_stiffness_n_m=softer[k] * segment.tendon_stiffness_n_m,
                pretension_n=looser[k] * segment.pretension_n,
            )
            for k, segment in enumerate(robot.segments)
        )
    )
    own = {"tendon_stiffness": np.ones((2, count)), "pretension": np.ones((2, count))}
    own["tendon_stiffness"][1], own["pretension"][1] = softer, looser
    together = moved(robot, 2, own, off)
    for row, other in ((0, robot), (1, compiled)):
        alone = moved(other, 1, off=off)
        for noun, tolerance in (("tip_position", 1e-8), ("tension", 1e-4)):
            np.testing.assert_allclose(
                getattr(together.state, noun)[row],
                getattr(alone.state, noun)[0],
                rtol=0,
                atol=tolerance,
            )
    clarke = np.tile([[0.004, -0.002]], (1, count, 1))  # the rest pose
    together.reset(np.array([1]), clarke)
    np.testing.assert_allclose(
        together._engine.qpos[1], moved(compiled, 1).rest(clarke)[0], rtol=0, atol=1e-12
    )


OWN = {
    "tendon_stiffness": np.array([[1.0], [0.02], [0.3]]),
    "pretension": np.array([[1.0], [0.5], [0.0]]),
    "intact": np.array([[1, 1, 1, 1], [1, 0, 1, 1], [1, 1, 1, 1]], bool),
    "turn_rad": np.array([0.0, -1.0, 1.5]),
    "friction": np.array([0.0, 0.0, 0.3]),
}


@pytest.mark.parametrize("names", [[name] for name in OWN] + [list(OWN)], ids=str)
def test_one_robot_alone_is_the_one_in_a_batch_to_the_bit(names):
    robot = make_robot(n_tendons=4)
    off = np.array([1e-4, -1e-4, 1e-4, -1e-4])
    together = moved(robot, 3, {name: OWN[name] for name in names}, off, steps=6)
    for row in range(3):
        alone = moved(robot, One(), {name: OWN[name][row : row + 1] for name in names}, off, 6)
        for noun in ("tip_position", "tension", "velocity", "displacement"):
            np.testing.assert_array_equal(
                getattr(together.state, noun)[row], getattr(alone.state, noun)[0]
            )


def test_a_broken_tendon_leaves_the_robot_that_was_compiled_without_it():
    robot = make_robot(n_tendons=4)
    left = replace(
        robot.segments[0], n_tendons=3, tendon_angles_rad=tuple(robot.segments[0].angles[:3])
    )
    intact = np.array([[True, True, True, False]])
    for clarke in ((0.006, 0.002), (-0.004, 0.003), (0.002, -0.006)):  # the last: nobody pulls
        broken = moved(robot, 1, {"intact": intact}, clarke=clarke, steps=60)
        compiled = moved(Robot((left,)), 1, clarke=clarke, steps=60)
        np.testing.assert_allclose(
            broken.state.tip_position, compiled.state.tip_position, rtol=0, atol=2e-7
        )
        np.testing.assert_allclose(broken.tension[0, :3], compiled.tension[0], rtol=0, atol=1e-2)
        assert broken.tension[0, 3] == 0.0


def test_helical_tendons_are_those_of_a_model_compiled_with_them():
    robot, turn, clarke = make_robot("slim"), 1.2, np.array([[0.003, 0.001]] * 2)
    chain = build_chain(robot, PROFILES["fast"])
    root = ElementTree.fromstring(mjcf(robot, profile="fast", winding=True))
    starts = np.cumsum([0.0, *robot.lengths])
    at = {
        chain.model.joint(k).name: chain.stations[chain.model.jnt_bodyid[k]]
        for k in range(chain.model.njnt)
    }
    for tendon in root.findall("tendon/fixed"):
        segment, index = (int(k) for k in tendon.get("name").removeprefix("tendon").split("_"))
        for part in tendon:
            name = part.get("joint")
            passed = int(name[1])
            share = passed + (at[name] - starts[passed]) / robot.lengths[passed]
            x, y = tendon_offsets(robot.segments[segment])[index]
            cos, sin = np.cos(turn * share), np.sin(turn * share)
            coefficient = sin * x + cos * y if name[0] == "x" else sin * y - cos * x
            part.set("coef", repr(float(coefficient)))
    model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    data = mujoco.MjData(model)
    own = MujocoPhysics(robot, 3, 0.05)
    # The least friction keeps the third from being folded.
    friction = np.array([0.0, 0.0, 1e-12])
    own.vary(np.arange(3), {"turn_rad": np.array([0.0, turn, turn]), "friction": friction})
    own.reset(np.arange(3), np.tile(clarke, (3, 1, 1)))
    data.qpos[:] = own._engine.qpos[1]
    told = robot.decoder @ clarke.reshape(-1)
    data.act[:] = -told - own._springs.preload[1]
    for _ in range(40):
        own.step(JointVector.from_clarke(np.tile(clarke, (3, 1, 1))))
        mujoco.mj_step(model, data, 10)
    mujoco.mj_forward(model, data)
    tip = data.site("tip").xpos
    assert np.linalg.norm(tip - own.state.tip_position[0]) > 2e-3
    np.testing.assert_allclose(own.state.tip_position[1], tip, rtol=0, atol=1e-8)
    np.testing.assert_allclose(own.state.tip_position[2], tip, rtol=0, atol=5e-6)


@pytest.mark.parametrize("turn", [0.3, 1.0, np.pi / 2])
def test_a_helix_bends_as_the_balance_of_a_rod_says(turn):
    own = moved(
        make_robot(n_tendons=8),
        1,
        {"turn_rad": np.array([turn])},
        steps=60,
        profile="accurate",
        **WEIGHTLESS,
    )
    x, y = settled_bends(own)[0] * 0.01
    sinc = np.sin(turn / 2) / (turn / 2)
    assert np.hypot(x, y) == pytest.approx(sinc * np.hypot(0.006, 0.002), rel=2e-3)
    assert np.arctan2(y, x) == pytest.approx(np.arctan2(0.002, 0.006) + turn / 2, abs=1e-6)


@pytest.mark.parametrize("name", ["two_segment", "slim", "hardware"])
def test_both_physics_have_the_same_helix_to_second_order_of_its_turn(name):
    robot, clarke = make_robot(name), np.array([0.003, 0.001])
    rows, clarke = np.array([0]), np.tile(clarke, (1, robot.n_segments, 1))
    gaps = []
    for turn in (0.2, 0.1):
        arcs = DISTURBANCES["helical"](robot, 1, strength=turn / (np.pi / 2))
        arcs.begin(rows, np.array([[1.0]]), np.zeros((1, robot.n_joints)))
        expected = arcs.step(clarke.reshape(1, -1) @ robot.decoder.T) @ robot.encoder.T
        straight, wound = (
            MujocoPhysics(robot, 1, 0.05, profile="accurate", **WEIGHTLESS) for _ in range(2)
        )
        wound.vary(rows, {"turn_rad": np.array([turn])})
        stretch = []
        for physics in (straight, wound):
            physics.reset(rows, clarke)  # at rest already, without other loads
            stretch.append(settled_bends(physics) * np.repeat(robot.pitch_radii, 2))
        moved_by = stretch[1] - stretch[0]
        gaps.append(np.abs(moved_by - (expected - clarke.reshape(1, -1))).max())
        assert gaps[-1] < 0.12 * np.abs(moved_by).max()
    assert gaps[0] > 3.0 * gaps[1] or gaps[0] < 2e-5


def test_rest_is_where_nothing_moves_whatever_is_slack_or_broken():
    robot = make_robot("two_segment_4")
    physics = MujocoPhysics(robot, 4, 0.05, **WEIGHTLESS)
    rows, clarke = np.arange(4), np.tile([[0.006, -0.004], [0.002, 0.009]], (4, 1, 1))
    intact = np.ones((4, 8), bool)
    intact[1, 2] = intact[2, [0, 5]] = False
    physics.vary(
        rows,
        {
            "intact": intact,
            "pretension": np.array([[1.0, 1.0], [1.0, 1.0], [0.2, 1.0], [0.0, 0.0]]),
            "tendon_stiffness": np.tile([[0.02, 0.05]], (4, 1)),
        },
    )
    physics.reset(rows, clarke)
    start = physics._engine.qpos.copy()
    physics.step(JointVector.from_clarke(clarke))
    assert (physics.tension < 1e-9).any(1).tolist() == [False, True, True, True]
    np.testing.assert_allclose(physics._engine.qpos, start, rtol=0, atol=1e-6)


def test_rest_solves_the_complementarity_problem():
    rng = np.random.default_rng(0)
    jacobian, elastic = rng.normal(size=(200, 6, 5)), rng.uniform(0.5, 2.0, (200, 5))
    command, stiffness = rng.normal(size=(200, 6)), rng.uniform(0.0, 10.0, (200, 6))
    stiffness[stiffness < 2.0] = 0.0
    pulls = np.array([True] * 5 + [False])
    rest = resting(command, stiffness, pulls, jacobian, elastic)
    tension = stiffness * (command - np.matvec(jacobian, rest))
    tension = np.where(pulls, np.maximum(tension, 0.0), tension)
    left = elastic * rest - np.vecmat(tension, jacobian)
    np.testing.assert_allclose(left, 0.0, atol=1e-10)


@pytest.mark.parametrize("name", ["default", "hardware"])
def test_tendons_that_give_bend_as_their_ratio_says(name):
    robot = make_robot(name)
    made = DISTURBANCES["tendon_stiffness"](robot, 1)
    numbers = made.vary(np.array([[1.0]]))
    ratios = [1.0 / taut_gain(segment) - 1.0 for segment in robot.segments]
    softer = [
        replace(segment, tendon_stiffness_n_m=segment.tendon_stiffness_n_m * factor)
        for segment, factor in zip(robot.segments, numbers["tendon_stiffness"][0], strict=True)
    ]
    for segment, ratio in zip(softer, ratios, strict=True):
        assert taut_gain(segment) == pytest.approx(1.0 / (1.0 + ratio + 0.3), rel=1e-12)
    if robot.n_segments == 1:
        physics = MujocoPhysics(robot, 1, 0.05, **WEIGHTLESS)
        physics.vary(np.array([0]), numbers)
        physics.reset(np.array([0]), np.array([[[0.006, 0.002]]]))
        np.testing.assert_allclose(
            settled_bends(physics)[0], np.array([0.6, 0.2]) / (1.3 + ratios[0]), rtol=1e-9
        )


def test_lost_pretension_is_missing_from_the_straight_robot():
    robot = make_robot(n_tendons=4)
    made = DISTURBANCES["pretension"](robot, 3)
    physics = MujocoPhysics(robot, 3, 0.05, **WEIGHTLESS)
    physics.vary(np.arange(3), made.vary(np.array([[0.0], [0.7], [1.0]])))
    physics.reset(np.arange(3), np.zeros((3, 1, 2)))
    np.testing.assert_allclose(physics.tension, np.outer([10.0, 3.0, 0.0], np.ones(4)), atol=1e-9)


def drags(pretension_n, mu, steps=60):
    """Return the tensions that friction takes while tendons 0 and 2 move, and at rest later [N]."""
    segment = replace(make_robot(n_tendons=4).segments[0], pretension_n=pretension_n)
    found = []
    for friction in (0.0, mu):
        vary = {"friction": np.array([friction])}
        physics = moved(Robot((segment,)), 1, vary, steps=steps, clarke=(0.008, 0.0), **WEIGHTLESS)
        bend = settled_bends(physics)[0, 0]
        found.append(physics.tension[0])
    return found[1] - found[0], found[0], bend


@pytest.mark.parametrize("pretension_n", [10.0, 30.0])
def test_friction_grows_with_tension_and_bend_as_the_capstan_equation_says(pretension_n):
    mu = 0.3
    taken, without, bend = drags(pretension_n, mu)
    angles = np.linspace(0.0, bend, 20001)
    left = np.exp(-mu * angles).mean()  # of a tendon that is pulled in, on the mean of its way
    moment = taken[0] - taken[2]
    # Each tendon's own friction is of its own tension, with friction in it.
    expected = (1.0 - left) * (2.0 * without[0] + 2.0 * without[2] + taken[0] + taken[2]) / 2.0
    assert moment == pytest.approx(expected, rel=0.01)
    assert taken[0] > 0.0 > taken[2]


def test_friction_holds_what_stopped():
    early, late = (drags(10.0, 0.3, steps)[0] for steps in (30, 130))
    np.testing.assert_allclose(early[[0, 2]], late[[0, 2]], rtol=0.02)


def test_friction_leaves_a_straight_robot_alone():
    robot = make_robot(n_tendons=4)
    physics = MujocoPhysics(robot, 2, 0.05, **WEIGHTLESS)
    physics.vary(np.arange(2), {"friction": np.array([0.0, 0.4])})
    physics.reset(np.arange(2), np.zeros((2, 1, 2)))
    physics.pull(np.array([[0.0, 0.02, 0.0]] * 2))
    for _ in range(4):
        physics.step(JointVector.from_clarke(np.zeros((2, 1, 2))))
    tips = physics.state.tip_position
    np.testing.assert_allclose(tips[0], tips[1], rtol=0, atol=2e-5)


def test_tendons_that_no_two_stand_for_cannot_vary():
    physics = MujocoPhysics(Robot(), 1, 0.05, routing="chord")
    with pytest.raises(ValueError, match=r"turn_rad.*'chord'"):
        physics.vary(np.array([0]), {"turn_rad": np.array([1.0])})


def test_a_robot_that_has_lost_pretension_depends_on_nothing_before_its_reset():
    """Nor on what robots beside it have off the manifold."""
    keywords = {"n_tendons": 3, "disturbances": "pretension", "physics": "mujoco"}
    used = gym.make_vec("clarke_gym/Reach-v0", num_envs=2, **keywords)
    scalar = gym.make("clarke_gym/Reach-v0", **keywords)
    for seed in range(12):
        action = np.random.default_rng(seed).uniform(-1.0, 1.0, 3).astype(np.float32)
        scalar.reset(seed=seed)
        used.reset(seed=[seed, 0])
        used.step(np.ones((2, 3), np.float32))  # all off the manifold
        used.reset(seed=[seed, None], options={"reset_mask": np.array([True, False])})
        told = used.step(np.stack([action, np.ones(3, np.float32)]))[0][0]
        np.testing.assert_array_equal(told, scalar.step(action)[0])
