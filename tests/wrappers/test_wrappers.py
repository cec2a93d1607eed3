"""Noise, delays and history: scalar and vector to the bit, seeded, in every autoreset mode."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import (
    ClipAction,
    DelayObservation,
    FlattenObservation,
    FrameStackObservation,
    RescaleAction,
)

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym import wrappers
from clarke_gym.wrappers import vector

ID = "clarke_gym/Reach-v0"
KEYWORDS = {"n_tendons": 5, "representation": "clarke", "episode_steps": 7}
WRAPPERS = {
    "noise": (wrappers.NoisyObservation, vector.NoisyObservation, {"deviation": 0.05}),
    "noise of a sensor": (
        wrappers.NoisyObservation,
        vector.NoisyObservation,
        {"deviation": 0.05, "sensors": "tip_position+displacement"},
    ),
    "late action": (wrappers.DelayedAction, vector.DelayedAction, {"delay": 2}),
    "late observation": (DelayObservation, vector.DelayObservation, {"delay": 2}),
    "history": (FrameStackObservation, vector.FrameStackObservation, {"stack_size": 3}),
    "history of zeros": (
        FrameStackObservation,
        vector.FrameStackObservation,
        {"stack_size": 3, "padding_type": "zero"},
    ),
}


def equal(one, other):
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for name in one:
            np.testing.assert_array_equal(one[name], other[name])
        return
    np.testing.assert_array_equal(one, other)


def row_of(batch, row):
    return {k: v[row] for k, v in batch.items()} if isinstance(batch, dict) else batch[row]


@pytest.mark.parametrize("goal_env", [False, True], ids=["box", "goal"])
@pytest.mark.parametrize("mode", ["next_step", "same_step", "disabled"])
@pytest.mark.parametrize("name", WRAPPERS)
def test_a_twin_is_the_scalar_wrapper_to_the_bit(name, mode, goal_env):
    scalar, twin, keywords = WRAPPERS[name]
    made = {**KEYWORDS, "goal_env": goal_env}
    envs = twin(gym.make_vec(ID, num_envs=3, autoreset_mode=mode, **made), **keywords)
    alone = [scalar(gym.make(ID, **made), **keywords) for _ in range(3)]
    many = envs.reset(seed=4)[0]
    # Episodes of one environment are shorter from the start: not all begin at once.
    shown = [env.reset(seed=4 + row)[0] for row, env in enumerate(alone)]
    if mode == "disabled":  # the middle one begins once more
        envs.step(np.zeros((3, 2), np.float32))
        for row, env in enumerate(alone):
            shown[row] = env.step(np.zeros(2, np.float32))[0]
        many = envs.reset(options={"reset_mask": np.array([False, True, False])})[0]
        shown[1] = alone[1].reset()[0]
    ended = np.zeros(3, bool)
    rng = np.random.default_rng(0)
    for _ in range(25):
        for row in range(3):
            equal(row_of(many, row), shown[row])
        assert envs.observation_space.contains(many)
        kept = {k: v.copy() for k, v in many.items()} if goal_env else many.copy()
        before = many
        actions = rng.uniform(-1, 1, (3, 2)).astype(np.float32)
        many, reward, _, truncated, info = envs.step(actions)
        equal(before, kept)  # nobody writes to what was returned
        now = np.zeros(3, bool)
        for row, env in enumerate(alone):
            if mode == "next_step" and ended[row]:
                shown[row] = env.reset()[0]
                continue
            shown[row], own, _, now[row], _ = env.step(actions[row])
            assert own == reward[row]
            if mode == "same_step" and now[row]:
                equal(info["final_obs"][row], shown[row])
                shown[row] = env.reset()[0]
        np.testing.assert_array_equal(truncated, now)
        ended = now
        if mode == "disabled" and ended.any():
            many = envs.reset(options={"reset_mask": ended})[0]
            for row in np.flatnonzero(ended):
                shown[row] = alone[row].reset()[0]


@pytest.mark.parametrize("name", WRAPPERS)
def test_a_seed_repeats_and_specs_round_trip(name):
    scalar, _, keywords = WRAPPERS[name]
    env = scalar(gym.make(ID, **KEYWORDS), **keywords)
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    traces = []
    for one in (env, env, again):
        trace = [one.reset(seed=3)[0]]
        trace += [one.step(np.float32([0.7, -0.2]))[0] for _ in range(5)]
        traces.append(np.array(trace))
    np.testing.assert_array_equal(traces[0], traces[1])
    np.testing.assert_array_equal(traces[0], traces[2])
    other = env.reset(seed=8)[0]
    assert name == "late observation" or not np.array_equal(other, traces[0][0])


def test_noise_has_the_deviation_that_was_asked_for_and_goals_stay():
    envs = gym.make_vec(ID, num_envs=64, n_tendons=3, goal_env=True, sensors="tip_position")
    noisy = vector.NoisyObservation(envs, 0.01)
    told, true = [], []
    noisy.reset(seed=0)
    for _ in range(40):
        seen = noisy.step(np.zeros((64, 3), np.float32))[0]
        told.append(seen["observation"])
        true.append(envs.unwrapped._core.observe())
        equal(seen["achieved_goal"], true[-1]["achieved_goal"])
        equal(seen["desired_goal"], true[-1]["desired_goal"])
    gap = np.array(told) - np.array([one["observation"] for one in true])
    inside = gap[..., :2]  # the tip's height is at its bound
    assert inside.std() == pytest.approx(0.01, rel=0.05)
    assert abs(inside.mean()) < 4 * 0.01 / np.sqrt(inside.size)
    flat = inside.reshape(40, -1)
    assert abs(np.mean(flat[1:] * flat[:-1])) < 4 * 0.01**2 / np.sqrt(flat.size)  # white


@pytest.mark.parametrize("n", [3, 7])
def test_noise_finds_its_sensors_above_a_representation_put_on_by_hand(n):
    sensors = "displacement+tip_position"
    plain = wrappers.ClarkeObservation(gym.make(ID, n_tendons=n))
    plains = vector.ClarkeObservation(gym.make_vec(ID, num_envs=2, n_tendons=n))
    for noisy, still in (
        (wrappers.NoisyObservation(plain, sensors=sensors), plain),
        (vector.NoisyObservation(plains, sensors=sensors), plains),
    ):
        differ = noisy.reset(seed=1)[0] != still.reset(seed=1)[0]
        places = np.flatnonzero(differ.reshape(-1, 13).any(0))
        assert places.tolist() == [2, 3, 4, 5, 6]  # after two of the command, before the goal


def test_a_first_reset_of_all_may_name_all():
    envs = vector.NoisyObservation(gym.make_vec(ID, num_envs=2), 0.05)
    plain = vector.NoisyObservation(gym.make_vec(ID, num_envs=2), 0.05)
    masked = envs.reset(seed=3, options={"reset_mask": np.ones(2, bool)})[0]
    np.testing.assert_array_equal(masked, plain.reset(seed=3)[0])


@pytest.mark.parametrize("action", [[0.1, 0.1, np.nan], [0.1], 0.1])
def test_a_late_action_is_checked_when_it_is_given(action):
    env = wrappers.DelayedAction(gym.make(ID), 2)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="actions must be finite"):
        env.step(np.float32(action))


@pytest.mark.parametrize("name", ["raw", "clarke", "arc_polar"])
def test_drives_wait_for_a_late_action_in_every_representation(name):
    by_keyword = gym.make(ID, n_tendons=5, action_representation=name)
    by_hand = gym.make(ID, n_tendons=5)
    if name != "raw":
        by_hand = wrappers.RepresentationAction(by_hand, name)
    for env in (by_keyword, by_hand):
        late = wrappers.DelayedAction(env, 2)
        late.reset(seed=1)
        late.action_space.seed(0)
        start = env.unwrapped.physics.state.command
        for k in range(3):
            late.step(late.action_space.sample())
            gone = np.abs(env.unwrapped.physics.state.command - start).max()
            assert (gone > 1e-6) == (k == 2)


def test_lifted_bounds_change_no_number():
    plain = gym.make(ID, n_tendons=5)
    clipped = ClipAction(gym.make(ID, n_tendons=5))
    for wrapped in (wrappers.ClarkeAction, lambda env: wrappers.DelayedAction(env, 1)):
        ours, theirs = wrapped(clipped), wrapped(plain)
        np.testing.assert_array_equal(ours.reset(seed=0)[0], theirs.reset(seed=0)[0])
        for action in np.random.default_rng(0).uniform(-0.3, 0.3, (3, *ours.action_space.shape)):
            np.testing.assert_array_equal(ours.step(action)[0], theirs.step(action)[0])


def test_wrappers_stack_and_rewards_are_asked_of_them():
    env = gym.make(ID, goal_env=True, **KEYWORDS)
    env = wrappers.DelayedAction(wrappers.NoisyObservation(env, 0.01), 1)
    seen = env.reset(seed=0)[0]
    seen, reward, *_ = env.step(np.float32([0.1, 0.2]))
    assert env.compute_reward(seen["achieved_goal"], seen["desired_goal"], {}) == reward


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda env: wrappers.NoisyObservation(env, -1.0), ValueError, "deviation"),
        (lambda env: wrappers.NoisyObservation(env, 0.1, "tipp"), ValueError, "tipp"),
        (
            lambda env: wrappers.NoisyObservation(
                FlattenObservation(FrameStackObservation(env, 4)), 0.1, "goal"
            ),
            ValueError,
            "15 numbers wide; a wrapper below makes them 60 wide",
        ),
        (
            lambda env: wrappers.ClarkeAction(wrappers.ClarkeAction(env)),
            ValueError,
            "a wrapper below writes them as 'clarke' already",
        ),
        (
            lambda env: wrappers.ClarkeObservation(wrappers.ClarkeObservation(env)),
            ValueError,
            "a wrapper below writes them as 'clarke' already",
        ),
        (
            lambda env: wrappers.ClarkeAction(RescaleAction(env, np.float32(0.0), np.float32(1.0))),
            ValueError,
            r"makes them \(3,\) from 0 to 1: put ClarkeAction on first",
        ),
        (
            lambda env: wrappers.ClarkeObservation(
                FlattenObservation(FrameStackObservation(env, 4))
            ),
            ValueError,
            r"makes them \(60,\) from .*: put ClarkeObservation on first",
        ),
        (lambda env: wrappers.DelayedAction(env, -1), ValueError, "delay"),
        (lambda env: wrappers.DelayedAction(env, 1.5), ValueError, "delay"),
        (
            lambda env: wrappers.DelayedAction(
                RescaleAction(env, np.float32(0.0), np.float32(1.0)), 1
            ),
            ValueError,
            "put DelayedAction on first",
        ),
        (
            lambda env: wrappers.DelayedAction(gym.make(ID, control="absolute"), 1),
            ValueError,
            "increment.*command_delay",
        ),
        (
            lambda env: vector.FrameStackObservation(gym.make_vec(ID, num_envs=1), 0),
            ValueError,
            "stack_size",
        ),
        (
            lambda env: vector.FrameStackObservation(
                gym.make_vec(ID, num_envs=1), 2, padding_type="x"
            ),
            ValueError,
            "padding_type",
        ),
    ],
)
def test_mistakes_are_named(make, error, message):
    with pytest.raises(error, match=message):
        make(gym.make(ID))
