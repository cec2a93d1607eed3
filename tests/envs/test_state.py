"""state() and restore(): the future repeats bit for bit, generators included."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding

from clarke_gym.control import make_controller
from clarke_gym.envs.episode import Episode
from clarke_gym.robots import Robot
from clarke_gym.tasks import Task

ID = "clarke_gym/Reach-v0"


def roll(envs, rng, steps):
    trace = []
    for _ in range(steps):
        actions = rng.uniform(-1, 1, envs.action_space.shape).astype(np.float32)
        observation, reward, _, truncated, _ = envs.step(actions)
        trace += [observation, reward, truncated]
    return trace


@pytest.mark.parametrize("physics", ["constant_curvature", "mujoco"])
@pytest.mark.parametrize("representation", ["raw", "clarke"])
@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_vector_future_repeats_across_resets(physics, representation, mode):
    envs = gym.make_vec(
        ID,
        num_envs=5,
        n_tendons=5,
        n_segments=2,
        representation=representation,
        physics=physics,
        max_episode_steps=2,
        autoreset_mode=mode,
    )
    envs.reset(seed=0)
    roll(envs, np.random.default_rng(0), 6)
    state = pickle.loads(pickle.dumps(envs.unwrapped.state()))
    first = roll(envs, np.random.default_rng(1), 50)  # more episodes than one block of numbers
    envs.unwrapped.restore(state)
    second = roll(envs, np.random.default_rng(1), 50)
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a, b)


def test_state_is_a_copy():
    env = gym.make(ID)
    env.reset(seed=0)
    state = env.unwrapped.state()
    kept = copy.deepcopy(state)
    env.step(np.array([1.0, -0.5, -0.5]))
    env.reset()
    for name in ("parameters", "numbers", "steps"):
        np.testing.assert_array_equal(state["episode"][name], kept["episode"][name])
    np.testing.assert_array_equal(
        state["physics"]["now"]["clarke"], kept["physics"]["now"]["clarke"]
    )


def test_scalar_state_moves_to_another_environment():
    source, target = gym.make(ID, n_tendons=4), gym.make(ID, n_tendons=4)
    source.reset(seed=9)
    target.reset(seed=1)
    target.unwrapped.restore(source.unwrapped.state())
    action = np.array([0.3, -0.2, 0.9, 0.1])
    np.testing.assert_array_equal(source.step(action)[0], target.step(action)[0])
    np.testing.assert_array_equal(source.reset()[0], target.reset()[0])


class Numbers(Task):
    """A task whose goals are the numbers of its episodes."""

    numbers = 4

    def begin(self, numbers):
        return np.zeros((len(numbers), 1, 2)), numbers

    def evaluate(self, state, goal):
        raise AssertionError("not asked")


def episodes(num_envs):
    return Episode(Numbers(Robot()), num_envs, 0.05, 50, lambda bending: (bending, bending[:, 0]))


def test_episodes_are_the_numbers_of_their_own_generators_in_order():
    episode = episodes(3)
    for index, seed in enumerate((5, 6, 7)):
        episode.seed(index, seed)
    expected = {i: seeding.np_random(5 + i)[0].random((3 * Task.prepared, 4)) for i in range(3)}
    taken = dict.fromkeys(range(3), 0)
    rng = np.random.default_rng(0)
    for _ in range(2 * Task.prepared):
        rows = np.flatnonzero(rng.random(3) < 0.6)
        episode.start(rows)
        for row in rows.tolist():
            np.testing.assert_array_equal(episode.goal[row], expected[row][taken[row]])
            taken[row] += 1


def test_an_environment_by_itself_draws_what_it_draws_beside_others():
    alone, beside = episodes(1), episodes(3)
    alone.seed(0, 6)
    beside.seed(1, 6)
    for draw in range(2 * Task.prepared + 3):
        alone.start(np.array([0]))
        beside.start(np.array([1, 2] if draw % 3 else [1]))
        np.testing.assert_array_equal(alone.goal[0], beside.goal[1])
        if draw == Task.prepared + 2:
            state = alone.get_state()
            alone = episodes(1)
            alone.set_state(state)


@pytest.mark.parametrize("representation", ["raw", "clarke"])
def test_a_restored_environment_keeps_its_time_limit(representation):
    """The clock is inside: restored at step 30, an episode has 20 more steps."""
    env = gym.make(ID, representation=representation)
    env.reset(seed=0)
    for _ in range(30):
        env.step(env.action_space.sample())
    state = env.unwrapped.state()
    env.reset(seed=1)
    env.unwrapped.restore(state)
    ends = [env.step(env.action_space.sample())[3] for _ in range(20)]
    assert ends == [False] * 19 + [True]


def test_episode_steps_sets_any_limit():
    env = gym.make(ID, episode_steps=73)
    env.reset(seed=0)
    ends = [env.step(env.action_space.sample())[3] for _ in range(73)]
    assert ends == [False] * 72 + [True]


@pytest.mark.parametrize("physics", ["constant_curvature", "mujoco"])
def test_steps_and_pictures_before_the_first_reset_are_refused(physics):
    env = gym.make(ID, physics=physics, representation="clarke", render_mode="rgb_array")
    envs = gym.make_vec(ID, num_envs=2, physics=physics, autoreset_mode="disabled")
    for each in (env, envs):
        with pytest.raises(ResetNeeded, match="first step"):
            each.step(each.action_space.sample())
    with pytest.raises(ResetNeeded, match="first picture"):
        env.render()
    with pytest.raises(ResetNeeded, match="reset_mask"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    state = env.unwrapped.state()
    env.reset(seed=0)
    env.step(env.action_space.sample())
    env.unwrapped.restore(state)
    with pytest.raises(ResetNeeded):
        env.step(env.action_space.sample())


def test_a_touch_is_kept_by_restore_and_forgotten_by_reset():
    make = {"id": "clarke_gym/Wrap-v0", "representation": "clarke"}
    env = gym.make(**make)
    agent = make_controller("clarke_controller", env)
    observation, _ = env.reset(seed=0)
    for _ in range(70):
        observation, _, _, _, info = env.step(agent.act(observation))
    assert info["contact_force_n"] > 1.0
    twin = copy.deepcopy(env)
    assert twin.unwrapped.physics.contact_force[0] == info["contact_force_n"]
    fresh, used = gym.make(**make).reset(seed=5), env.reset(seed=5)
    np.testing.assert_array_equal(fresh[0], used[0])
    assert used[1]["contact_force_n"] == 0.0


def test_an_episode_that_runs_keeps_its_bars_when_the_difficulty_changes():
    env = gym.make("clarke_gym/Gate-v0", difficulty=0.0)
    env.reset(seed=0)
    env.unwrapped.set_difficulty(1.0)
    twin = copy.deepcopy(env)
    told = [each.step(np.zeros(3, np.float32)) for each in (env, twin)]
    np.testing.assert_array_equal(told[0][0], told[1][0])
    assert told[0][4] == told[1][4]
    np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])


@pytest.mark.parametrize("env_id", ["Gate", "Nest", "Wrap"])
def test_states_of_earlier_versions_are_taken(env_id):
    envs = gym.make_vec(f"clarke_gym/{env_id}-v0", num_envs=2, n_tendons=4)
    envs.reset(seed=0)
    state = envs.unwrapped.state()
    old = {name: part for name, part in state.items() if name not in ("bodies", "pulled")}
    old["physics"] = {k: v for k, v in state["physics"].items() if k != "contact_force"}
    action = np.zeros(envs.action_space.shape, np.float32)
    expected = envs.step(action)[0]
    envs.unwrapped.restore(old)
    np.testing.assert_array_equal(envs.step(action)[0], expected)
