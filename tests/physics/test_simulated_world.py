"""What a simulated robot is told of its world: bodies, loads, and where it begins."""

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.numerics.batch import One
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot, Segment, make_robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.scene import Capsule, Scene

from .conftest import CONTROL_DT


@pytest.mark.parametrize("robots", [1, 2])
@pytest.mark.parametrize("compiled_m", [0.06, 0.002])
def test_bodies_that_have_grown_since_the_model_was_compiled_are_felt(robots, compiled_m):
    body = Capsule((0.085, 0.0, 0.17), (0.085, 0.0, 0.17), compiled_m)
    scene = Scene((body,), placed=True, resized=True)
    physics = MujocoPhysics(Robot(), One() if robots == 1 else robots, CONTROL_DT, scene=scene)
    rows = np.arange(robots)
    physics.place(rows, np.tile([0.085, 0.0, 0.17, 0.085, 0.0, 0.17, 0.06], (robots, 1, 1)))
    physics.reset(rows, np.zeros((robots, 1, 2)))
    target = JointVector.from_clarke(np.tile([0.01, 0.0], (robots, 1, 1)), batch=physics.batch)
    for _ in range(40):
        physics.step(target)
    assert (physics.contact_force > 1.0).all()
    assert (physics.state.clearance > -5e-4).all()


def test_bodies_that_are_moved_between_steps_are_felt_at_once_by_one_and_by_many():
    forces = []
    for batch in (One(), 1):
        body = Capsule((0.03, -0.1, 0.15), (0.03, 0.1, 0.15), 0.01)
        physics = MujocoPhysics(Robot(), batch, CONTROL_DT, scene=Scene((body,), placed=True))
        physics.reset(np.array([0]), np.zeros((1, 1, 2)))
        target = JointVector.from_clarke(np.array([[[0.004, 0.0]]]), batch=physics.batch)
        for step in range(6):
            if step == 3:
                moved = np.array([[[0.02, -0.1, 0.15, 0.02, 0.1, 0.15, 0.01]]])
                physics.place(np.array([0]), moved)
            physics.step(target)
            forces.append(physics.contact_force[0])
    assert forces[:6] == forces[6:]
    assert max(forces) > 0.0


SOFT = {"tendon_stiffness_n_m": 2000.0, "pretension_n": 1.0}


@pytest.mark.parametrize("stiffness", [None, 1.3])
@pytest.mark.parametrize("robot", ["hardware", "two_segment", "soft tendons"])
def test_weightless_robots_begin_at_rest_also_where_a_tendon_is_slack(robot, stiffness):
    robots = 16
    arm = Robot((Segment(**SOFT),)) if robot == "soft tendons" else make_robot(robot)
    physics = MujocoPhysics(arm, robots, CONTROL_DT, gravity_m_s2=(0.0, 0.0, 0.0))
    rows, rng = np.arange(robots), np.random.default_rng(0)
    if stiffness is not None:
        physics.vary(rows, {"stiffness": np.full(robots, stiffness)})
    angle = rng.uniform(0.0, 2.0 * np.pi, (robots, arm.n_segments))
    size = 0.7 * rng.uniform(0.0, 1.0, angle.shape) * arm.max_clarke
    clarke = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1)
    physics.reset(rows, clarke)
    before = physics.state.tip_position.copy()
    slack = (physics.tension <= 0.0).any()
    assert slack or robot == "two_segment"
    for _ in range(10):
        physics.step(JointVector.from_clarke(clarke))
    assert np.abs(physics.state.tip_position - before).max() < 1e-6


@pytest.mark.parametrize(
    ("robot", "keywords"),
    [("default", {"segment_length_m": 1.5}), ("two_segment", {"segment_length_m": 0.8})],
)
def test_robots_whose_own_weight_crushes_them_are_refused(robot, keywords):
    with pytest.raises(ValueError, match="more than it is likely to be simulated under"):
        gym.make("clarke_gym/Reach-v0", physics="mujoco", robot=robot, **keywords)


def test_long_robots_that_do_not_break_down_are_taken():
    for keywords in ({"segment_length_m": 1.1}, {"robot": "two_segment", "segment_length_m": 0.7}):
        envs = gym.make_vec("clarke_gym/Reach-v0", num_envs=4, physics="mujoco", **keywords)
        envs.reset(seed=0)
        for _ in range(30):
            *_, info = envs.step(np.zeros(envs.action_space.shape, np.float32))
            assert not info["diverged"].any()


def test_payloads_that_would_crush_a_robot_are_refused_whoever_brings_them():
    keywords = {"physics": "mujoco", "segment_length_m": 0.5}
    gym.make("clarke_gym/Reach-v0", disturbances="payload=3", **keywords)
    with pytest.raises(
        ValueError, match=r"'payload' of up to 0\.1 kg is more .* at most 0\.0395 kg"
    ):
        gym.make("clarke_gym/Reach-v0", disturbances="payload=10", **keywords)
    for wrong in (0.1, "a", None, True):
        with pytest.raises(ValueError, match="payload_kg"):
            gym.make("clarke_gym/Reach-v0", payload_kg=wrong, **keywords)
    together = gym.make(
        "clarke_gym/Reach-v0", disturbances="payload=3.7", payload_kg=0.036, **keywords
    )
    heavy = next(seed for seed in range(99) if np.random.default_rng([seed, 1]).random() > 0.5)
    with pytest.raises(ValueError, match="is more than this robot can be simulated under"):
        together.reset(seed=heavy)
