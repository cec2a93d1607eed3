"""One implementation: vector, scalar, by hand, by keyword and DummyVecEnv agree bit for bit."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from stable_baselines3.common.vec_env import DummyVecEnv

import clarke_gym
from clarke_gym.integrations.sb3 import Sb3VecEnv
from clarke_gym.registration import ENVIRONMENTS
from clarke_gym.representations import representation_names
from clarke_gym.representations.instruments import INSTRUMENTS
from clarke_gym.wrappers import vector as twins

ID = "clarke_gym/Reach-v0"
NUM = 5
MODES = ["next_step", "same_step", "disabled"]
PHYSICS = ["constant_curvature", "mujoco"]
REPRESENTATIONS = [name for name in representation_names() if name not in INSTRUMENTS]
VARIANTS = [
    {"representation": "raw", "n_tendons": 3},
    {"representation": "clarke", "n_tendons": 7},
    {"representation": "arc_polar", "n_tendons": 11},
    {"representation": "raw", "n_tendons": 32, "n_segments": 3},
    {"representation": "clarke_common", "n_tendons": 5, "n_segments": 2, "control": "absolute"},
    {"action_representation": "raw", "observation_representation": "clarke", "n_tendons": 7},
    {"representation": "clarke", "robot": "hardware"},
    {"representation": "projected", "n_tendons": 4, "goal_env": True, "reward": "sparse"},
    {"representation": "clarke", "n_tendons": 7, "physics": "mujoco"},
    {"representation": "raw", "n_tendons": 4, "n_segments": 2, "physics": "mujoco"},
]


def name(variant):
    return "-".join(str(value) for value in variant.values())


def assert_equal(a, b):
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            np.testing.assert_array_equal(a[key], b[key])
    else:
        np.testing.assert_array_equal(a, b)


def staggered(limits):
    """Scalar environments whose episodes end at different times."""
    return lambda variant: [
        (lambda limit=limit: gym.make(ID, max_episode_steps=int(limit), **variant))
        for limit in limits
    ]


@pytest.mark.parametrize("variant", VARIANTS, ids=name)
@pytest.mark.parametrize("mode", MODES)
def test_vector_environment_equals_sync_of_scalars(variant, mode):
    vector = gym.make_vec(ID, num_envs=NUM, max_episode_steps=7, autoreset_mode=mode, **variant)
    scalars = SyncVectorEnv(
        staggered([7] * NUM)(variant),
        autoreset_mode=AutoresetMode(vector.metadata["autoreset_mode"]),
    )
    assert vector.single_observation_space == scalars.single_observation_space
    assert vector.single_action_space == scalars.single_action_space
    rng = np.random.default_rng(0)
    assert_equal(vector.reset(seed=11)[0], scalars.reset(seed=11)[0])
    # Staggered episodes: some environments start again after 3 steps.
    mask = np.array([True, False, True, False, False])
    for k in range(40):
        if k == 3:
            a, _ = vector.reset(options={"reset_mask": mask})
            b, _ = scalars.reset(options={"reset_mask": mask.copy()})
            assert_equal(a, b)
        actions = rng.uniform(-1.3, 1.3, vector.action_space.shape).astype(np.float32)
        ours, theirs = vector.step(actions), scalars.step(actions)
        assert_equal(ours[0], theirs[0])
        for mine, other in zip(ours[1:4], theirs[1:4], strict=True):
            np.testing.assert_array_equal(mine, other)
        done = ours[2] | ours[3]
        live = np.ones(NUM, bool) if mode != "same_step" else ~done
        for key in ("tip_error_m", "is_success", "off_manifold_m"):
            if key in theirs[4]:
                np.testing.assert_array_equal(ours[4][key][live], theirs[4][key][live])
        if mode == "same_step" and done.any():
            np.testing.assert_array_equal(ours[4]["_final_obs"], theirs[4]["_final_obs"])
            for row in np.flatnonzero(done):
                assert_equal(ours[4]["final_obs"][row], theirs[4]["final_obs"][row])
        if mode == "disabled" and done.any():
            a, _ = vector.reset(options={"reset_mask": done})
            b, _ = scalars.reset(options={"reset_mask": done.copy()})
            assert_equal(a, b)


@pytest.mark.parametrize("variant", VARIANTS, ids=name)
def test_adapter_equals_dummy_vec_env(variant):
    ours = Sb3VecEnv(
        gym.make_vec(ID, num_envs=NUM, max_episode_steps=6, autoreset_mode="disabled", **variant)
    )
    theirs = DummyVecEnv(staggered([6] * NUM)(variant))
    ours.seed(5)
    theirs.seed(5)
    assert_equal(ours.reset(), theirs.reset())
    rng = np.random.default_rng(1)
    for _ in range(30):
        actions = rng.uniform(-1, 1, (NUM, *ours.action_space.shape)).astype(np.float32)
        a, b = ours.step(actions), theirs.step(actions)
        for mine, other in zip(a[:3], b[:3], strict=True):
            assert_equal(mine, other)
        assert a[1].dtype == b[1].dtype
        for done, mine, other in zip(a[2], a[3], b[3], strict=True):
            if done:
                assert_equal(mine["terminal_observation"], other["terminal_observation"])
                assert mine["TimeLimit.truncated"] == other["TimeLimit.truncated"]
                assert mine["is_success"] == other["is_success"]


def test_by_hand_by_keyword_and_vector_entry_point_agree():
    by_keyword = gym.make(ID, n_tendons=7, representation="clarke")
    by_hand = clarke_gym.ClarkeObservation(clarke_gym.ClarkeAction(gym.make(ID, n_tendons=7)))
    by_entry = gym.make_vec(ID, num_envs=1, n_tendons=7, representation="clarke")
    plain = gym.make_vec(ID, num_envs=1, n_tendons=7)
    by_twins = twins.ClarkeObservation(twins.ClarkeAction(plain))
    environments = [by_keyword, by_entry, by_hand, by_twins]
    traces = []
    for env in environments:
        vector = hasattr(env, "num_envs")
        rng = np.random.default_rng(2)
        trace = [env.reset(seed=[4] if vector else 4)[0]]
        for _ in range(45):
            action = rng.uniform(-1, 1, 2).astype(np.float32)
            observation, reward, *_ = env.step(action[None] if vector else action)
            trace += [observation, reward]
        traces.append([np.ravel(part) for part in trace])
    for k, trace in enumerate(traces):
        for a, b in zip(traces[0], trace, strict=True):
            if k < 2:
                np.testing.assert_array_equal(a, b)
            else:  # plain wrappers over joint space in single precision
                np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("name", REPRESENTATIONS)
@pytest.mark.parametrize("robot", ["two_segment_4", "hardware"])
def test_keyword_and_wrapper_write_the_same_observations(name, robot):
    """Of several segments, too, whose coordinates may be made of more than one."""
    try:
        envs = gym.make_vec(ID, num_envs=4, robot=robot, observation_representation=name)
    except ValueError:
        pytest.skip("not for this robot")
    plain = gym.make_vec(ID, num_envs=4, robot=robot)
    by_hand = twins.RepresentationObservation(plain, name)
    pairs = [(envs.reset(seed=2)[0], by_hand.reset(seed=2)[0])]
    for action in np.random.default_rng(0).uniform(-1, 1, (5, *plain.action_space.shape)):
        pairs.append((envs.step(action)[0], by_hand.step(action)[0]))
    for ours, theirs in pairs:
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=2e-5)


@pytest.mark.parametrize("physics", ["constant_curvature", "mujoco"])
def test_a_foreign_wrapper_between_changes_no_bit(physics):
    """Codecs are part of the environment: what stands on top sees the same numbers."""
    keywords = {"n_tendons": 7, "representation": "clarke", "physics": physics}
    plain, wrapped = gym.make(ID, **keywords), gym.make(ID, **keywords)
    wrapped = gym.wrappers.OrderEnforcing(gym.wrappers.ClipAction(wrapped))
    rng = np.random.default_rng(0)
    np.testing.assert_array_equal(plain.reset(seed=3)[0], wrapped.reset(seed=3)[0])
    for _ in range(40):
        action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
        ours, theirs = plain.step(action), wrapped.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:4] == theirs[1:4]


@pytest.mark.parametrize("segments", [1, 2])
@pytest.mark.parametrize("goal_env", [False, True])
def test_in_clarke_coordinates_the_number_of_tendons_cannot_be_told(segments, goal_env):
    """No number of tendons enters a constant-curvature episode: the same bits for every n."""
    traces = []
    for n in (3, 4, 7, 32):
        env = gym.make(
            ID, n_tendons=n, n_segments=segments, goal_env=goal_env, representation="clarke"
        )
        observation, _ = env.reset(seed=9)
        rng, trace = np.random.default_rng(1), [observation]
        for _ in range(45):
            action = rng.uniform(-1.5, 1.5, 2 * segments).astype(np.float32)
            trace += env.step(action)
        traces.append(repr(trace))
    assert len(set(traces)) == 1


def test_foreign_layers_below_the_wrappers_see_joint_space():
    """The short way to the core is for stacks in which nobody listens."""

    class Listener(gym.Wrapper):
        def step(self, action):
            self.action = action
            self.observation, *rest = self.env.step(action)
            return self.observation, *rest

    listener = Listener(gym.make(ID, n_tendons=7))
    env = clarke_gym.ClarkeObservation(clarke_gym.ClarkeAction(listener))
    direct = gym.make(ID, n_tendons=7, representation="clarke")
    np.testing.assert_allclose(env.reset(seed=4)[0], direct.reset(seed=4)[0], atol=1e-6)
    action = np.array([0.5, -0.25], np.float32)
    np.testing.assert_allclose(env.step(action)[0], direct.step(action)[0], atol=1e-6)
    assert np.shape(listener.action) == (7,)
    assert np.shape(listener.observation) == (23,)


@pytest.mark.parametrize("size", [1, 2, 63, 64, 65, 300])
def test_a_row_does_not_depend_on_its_neighbours(size):
    """Seed i in a batch of any size is the scalar environment of that seed."""
    keywords = {"n_tendons": 32, "n_segments": 3}
    vector = gym.make_vec(ID, num_envs=size, **keywords)
    scalar = gym.make(ID, **keywords)
    rng = np.random.default_rng(3)
    last = size - 1
    a, b = vector.reset(seed=20)[0][last], scalar.reset(seed=20 + last)[0]
    np.testing.assert_array_equal(a, b)
    for _ in range(10):
        actions = rng.uniform(-1, 1, vector.action_space.shape).astype(np.float32)
        ours, theirs = vector.step(actions), scalar.step(actions[last])
        np.testing.assert_array_equal(ours[0][last], theirs[0])
        assert ours[1][last] == theirs[1]


def test_list_seeds_and_partial_resets_touch_only_their_rows():
    envs = gym.make_vec(ID, num_envs=3, autoreset_mode="disabled", max_episode_steps=5)
    first, _ = envs.reset(seed=[8, None, 9])
    again, _ = envs.reset(seed=[8, None, 9])
    np.testing.assert_array_equal(first[[0, 2]], again[[0, 2]])
    assert not np.array_equal(first[1], again[1])
    before = again.copy()
    after, _ = envs.reset(options={"reset_mask": np.array([False, True, False])})
    np.testing.assert_array_equal(after[[0, 2]], before[[0, 2]])


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda e: e.reset(seed=[1, 2]), ValueError, "seed must hold 3 entries, got 2"),
        (lambda e: e.reset(options={"reset_mask": [True]}), TypeError, "bool array"),
        (lambda e: e.reset(options={"reset_mask": np.zeros(3, bool)}), ValueError, "one True"),
        (lambda e: e.reset(options={"gaol": 1}), ValueError, "'goal' only"),
        (lambda e: e.reset(options={"goal": [np.nan, 0, 0]}), ValueError, "finite"),
        (lambda e: e.step(np.zeros((2, 3))), ValueError, r"shape \(3, 3\), got \(2, 3\)"),
    ],
)
def test_bad_calls_are_named(call, error, message):
    envs = gym.make_vec(ID, num_envs=3)
    envs.reset(seed=0)
    with pytest.raises(error, match=message):
        call(envs)


def test_stepping_an_ended_episode_without_autoreset_is_refused():
    envs = gym.make_vec(ID, num_envs=2, max_episode_steps=1, autoreset_mode="disabled")
    envs.reset(seed=0)
    envs.step(np.zeros((2, 3), np.float32))
    with pytest.raises(RuntimeError, match="reset_mask"):
        envs.step(np.zeros((2, 3), np.float32))


def leaves(value):
    """Yield every array that a call has returned."""
    parts = value.values() if isinstance(value, dict) else value
    if isinstance(value, np.ndarray) and value.dtype != object:
        yield value
    elif parts is not None:
        for part in parts:
            yield from leaves(part)


EVERY = [
    (env_id, physics)
    for env_id, keywords in sorted(ENVIRONMENTS.items())
    if keywords
    for physics in ([keywords["physics"]] if "physics" in keywords else PHYSICS)
]


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("env_id", "physics"), EVERY)
def test_what_is_returned_can_be_written_to(env_id, physics, mode):
    """Learners write to done flags and rewards; nothing that comes later depends on it."""
    keywords = {"num_envs": 3, "physics": physics, "episode_steps": 4, "autoreset_mode": mode}
    keywords |= {"n_tendons": 4, "representation": "clarke"}
    pair = [gym.make_vec(env_id, **keywords) for _ in range(2)]
    results = [envs.reset(seed=1) for envs in pair]
    shape = pair[0].action_space.shape
    for k, action in enumerate(np.random.default_rng(0).uniform(-1, 1, (12, *shape))):
        kept, spoilt = (list(leaves(result)) for result in results)
        for number, (one, other) in enumerate(zip(kept, spoilt, strict=True)):
            np.testing.assert_array_equal(one, other)
            assert not any(np.shares_memory(one, earlier) for earlier in kept[:number])
            other[...] = True if other.dtype == bool else 77
        fresh = mode == "disabled" and k % 5 == 4
        results = [envs.reset() if fresh else envs.step(action) for envs in pair]
