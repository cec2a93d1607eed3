"""The Reach task: goals, rewards, success, and options."""

import json
import re
from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from scipy.stats import kstest

from clarke_gym import kinematics

ID = "clarke_gym/Reach-v0"


def test_goals_are_uniform_over_the_dome_and_reachable():
    envs = gym.make_vec(ID, num_envs=4000)
    envs.reset(seed=0)
    goal = envs.unwrapped.goal / envs.unwrapped.robot.length_m
    # A tip at radius r and height z of a unit arc: phi = 2 atan2(r, z) and |p| = sinc(phi / 2).
    phi = 2 * np.arctan2(np.hypot(goal[:, 0], goal[:, 1]), goal[:, 2])
    np.testing.assert_allclose(np.linalg.norm(goal, axis=1), np.sinc(phi / 2 / np.pi), atol=1e-7)
    grid = np.linspace(0, np.pi / 2, 4001)
    cdf = np.concatenate([[0], np.cumsum(kinematics.dome_density((grid[1:] + grid[:-1]) / 2))])
    assert kstest(phi, lambda x: np.interp(x, grid, cdf / cdf[-1])).pvalue > 0.01


def test_dense_reward_is_bounded_and_grows_towards_the_goal():
    env = gym.make(ID, goal_env=True)
    env.reset(seed=0)
    goal = np.array([0.3, 0.1, 0.8], np.float32)
    offsets = np.array([0.0, 0.005, 0.02, 0.1, 0.5, 1.9], np.float32)[:, None] * [1.0, 0, 0]
    rewards = env.unwrapped.compute_reward(goal + offsets.astype(np.float32), goal, {})
    assert rewards.shape == (6,)
    assert rewards[0] == 1.0
    assert (np.diff(rewards) < -1e-3).all()
    assert rewards[-1] > 0.0
    assert rewards[2] == pytest.approx(0.5 / 1.2 + 0.5 / np.e, abs=1e-5)


def test_reward_terms_add_up_and_error_is_the_distance():
    env = gym.make(ID, n_segments=2)
    env.reset(seed=3)
    _, reward, _, _, info = env.step(env.action_space.sample())
    tip, goal = env.unwrapped.physics.state.tip_position[0], env.unwrapped.goal[0]
    distance = np.linalg.norm(tip - goal)
    assert reward == info["reward_closeness"] + info["reward_precision"]
    assert info["tip_error_m"] == pytest.approx(distance, abs=1e-7)
    assert info["tip_error_percent"] == pytest.approx(100 * distance / 0.4, abs=1e-4)


@pytest.mark.parametrize("tolerance", [0.01, 0.02, 0.3])
def test_success_means_within_the_tolerance(tolerance):
    envs = gym.make_vec(ID, num_envs=200, success_tolerance=tolerance, random_start=False)
    rng = np.random.default_rng(0)
    goals = kinematics.segment_pose(2.5 * tolerance * rng.uniform(-1.0, 1.0, (200, 2)), 0.2)[0]
    envs.reset(seed=0, options={"goal": goals})
    info = envs.step(np.zeros(envs.action_space.shape, np.float32))[4]
    expected = np.linalg.norm(goals - [0.0, 0.0, 0.2], axis=1) <= 0.2 * tolerance
    assert 0.05 < expected.mean() < 0.95
    np.testing.assert_array_equal(info["is_success"], expected)


def test_sparse_reward_is_zero_on_success_only():
    env = gym.make(ID, reward="sparse", random_start=False)
    env.reset(seed=0, options={"goal": [0.0, 0.0, 0.2]})
    rewards = []
    for _ in range(10):
        _, reward, _, _, info = env.step(np.array([0.4, -0.2, -0.2]))
        assert reward == (0.0 if info["is_success"] else -1.0)
        rewards.append(reward)
    assert rewards[0] == 0.0
    assert rewards[-1] == -1.0


def test_compute_reward_repeats_the_reward_bit_for_bit_in_any_batch_shape():
    env = gym.make(ID, goal_env=True, n_tendons=7, representation="clarke")
    env.reset(seed=0)
    rows = []
    for _ in range(20):
        observation, reward, *_ = env.step(env.action_space.sample())
        achieved, desired = observation["achieved_goal"], observation["desired_goal"]
        assert env.unwrapped.compute_reward(achieved, desired, {}) == reward
        rows.append((achieved, desired, reward))
    achieved, desired, reward = (np.array(part) for part in zip(*rows, strict=True))
    batch = env.unwrapped.compute_reward(achieved.reshape(4, 5, 3), desired.reshape(4, 5, 3), {})
    np.testing.assert_array_equal(batch, reward.reshape(4, 5))


def test_a_goal_can_be_given():
    env = gym.make(ID, goal_env=True)
    goal = [0.05, -0.02, 0.185]
    observation, _ = env.reset(seed=0, options={"goal": goal})
    np.testing.assert_allclose(observation["desired_goal"], np.array(goal) / 0.2, rtol=1e-6)


def test_straight_start():
    env = gym.make(ID, goal_env=True, random_start=False)
    observation, _ = env.reset(seed=0)
    np.testing.assert_allclose(observation["achieved_goal"], [0, 0, 1], atol=1e-7)


def test_drives_lag_by_their_time_constant():
    """After one period the gap to a constant command is exp(-T / tau) of what it was."""
    env = gym.make(ID, random_start=False, control="absolute")
    env.reset(seed=0)
    env.step(np.array([1.0, -0.5, -0.5]))
    held = env.unwrapped.physics.state.displacement_vector.clarke[0, 0, 0]
    assert held == pytest.approx(0.001 * (1 - np.exp(-1.0)), rel=1e-12)


def test_time_limit_truncates_and_success_does_not_terminate():
    env = gym.make(ID, success_tolerance=1.0)
    env.reset(seed=0)
    ends = [env.step(env.action_space.sample())[2:4] for _ in range(50)]
    assert ends[:-1] == [(False, False)] * 49
    assert ends[-1] == (False, True)


@pytest.mark.parametrize("env_id", ["clarke_gym/Reach-v0", "clarke_gym/Pose-v0"])
def test_goals_out_of_reach_are_refused(env_id):
    env = gym.make(env_id)
    goal = np.zeros(len(env.unwrapped.task.goal.labels))
    goal[:3] = 0.0, 3.0 * env.unwrapped.robot.length_m, 0.0
    with pytest.raises(ValueError, match=r"out of reach by 2\.\d+ lengths of the robot"):
        env.reset(options={"goal": goal})


@pytest.mark.parametrize("make", [gym.make, partial(gym.make_vec, num_envs=2)])
def test_goals_off_the_dome_of_one_segment_are_refused(make):
    """Its tip cannot come to what is nearer than its length, either."""
    env = make(ID)
    env.reset(seed=0, options={"goal": [0.0, 0.0, 0.205]})
    for goal, apart in (([0.0, 0.0, 0.02], 0.833), ([0.0, 0.0, 0.15], 0.25)):
        with pytest.raises(ValueError, match=f"out of reach by {apart}") as error:
            env.reset(options={"goal": goal})
        env.reset(options={"goal": json.loads(re.search(r"is (\[.*?\]) m", str(error.value))[1])})


@pytest.mark.parametrize("n_segments", [2, 3])
def test_goals_where_no_tip_of_several_segments_comes_are_refused(n_segments):
    """Against the nearest of many sampled tips, drawn at the limits more often than inside."""
    env = gym.make(ID, n_segments=n_segments)
    robot, rng = env.unwrapped.robot, np.random.default_rng(n_segments)
    limits = [segment.max_bending_rad for segment in robot.segments]
    size = (100_000, n_segments)
    share = np.where(rng.uniform(size=size) < 0.5, 1.0, rng.uniform(size=size))
    turn = rng.uniform(0.0, 2.0 * np.pi, share.shape)
    bending = (share * limits)[..., None] * np.stack([np.cos(turn), np.sin(turn)], -1)
    tips = kinematics.forward(bending, robot.lengths)[0]
    refused = 0
    for goal in rng.uniform(-0.6, 0.6, (16, 3)) * robot.length_m:
        nearest = np.linalg.norm(tips - goal, axis=-1).min() / robot.length_m
        try:
            env.reset(options={"goal": goal})
            assert nearest < 0.07  # of a length: samples are a little apart
        except ValueError as error:
            said = float(re.search(r"by (\S+) lengths", str(error))[1])
            refused += 1
            assert 0.05 < said < nearest + 0.005
            hint = json.loads(re.search(r"is (\[.*?\]) m", str(error))[1])
            env.reset(options={"goal": hint})
            assert np.linalg.norm(hint - goal) / robot.length_m == pytest.approx(said, abs=2e-3)
    assert 4 < refused < 16
