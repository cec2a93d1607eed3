"""Gymnasium's conventions, as real clients met them."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

import clarke_gym
from clarke_gym.wrappers import vector as twins

ID = "clarke_gym/Reach-v0"


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_autoreset_mode_takes_gymnasiums_enum_and_vector_wrappers_show_it(mode):
    envs = gym.make_vec(ID, num_envs=2, n_tendons=5, autoreset_mode=mode)
    wrapped = twins.ClarkeObservation(twins.ClarkeAction(envs))
    for each in (envs, wrapped):
        assert each.autoreset_mode is mode
        assert each.metadata["autoreset_mode"] is mode
        assert each.num_envs == 2
        assert each.single_action_space.shape == ((5,) if each is envs else (2,))
    assert wrapped.robot is envs.unwrapped.robot
    assert wrapped.sensors is not None


def test_vector_wrappers_refuse_names_that_nobody_has():
    wrapped = twins.ClarkeAction(gym.make_vec(ID, num_envs=2))
    with pytest.raises(AttributeError, match="no_such_thing"):
        _ = wrapped.no_such_thing


def test_all_render_modes_are_listed_and_work():
    env = gym.make(ID, render_mode="rgb_array_list", render_width=64, render_height=64)
    assert set(env.metadata["render_modes"]) == {
        "rgb_array",
        "depth_array",
        "rgb_array_list",
        "human",
    }
    env.reset(seed=0)
    env.step(env.action_space.sample())
    frames = env.render()
    assert [frame.shape for frame in frames] == [(64, 64, 3)] * 2
    env.close()


def test_the_spec_of_wrappers_put_on_by_hand_round_trips():
    env = clarke_gym.ClarkeObservation(clarke_gym.ClarkeAction(gym.make(ID, n_tendons=6)))
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.action_space == env.action_space
    assert again.observation_space == env.observation_space
    np.testing.assert_array_equal(env.reset(seed=2)[0], again.reset(seed=2)[0])


def test_wrappers_by_hand_refuse_what_the_keyword_has_done_already():
    env = gym.make(ID, representation="clarke")
    with pytest.raises(ValueError, match="made with action_representation='clarke' already"):
        clarke_gym.ClarkeAction(env)
    with pytest.raises(ValueError, match="made with observation_representation='clarke' already"):
        clarke_gym.ClarkeObservation(env)


def test_a_robot_object_round_trips_through_json():
    robot = clarke_gym.Robot(
        (clarke_gym.Segment(n_tendons=4, tendon_angles_rad=(0.1, 1.7, 3.2, 4.9)),), name="bent"
    )
    env = gym.make(ID, robot=robot, representation="clarke")
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.robot == robot
    with pytest.raises(ValueError, match="would lose where the tendons of robot 'bent' are"):
        gym.make(ID, robot=robot, n_tendons=7)
    assert gym.make(ID, robot=robot, n_tendons=4).unwrapped.robot == robot


def test_scalar_info_holds_numpy_scalars():
    env = gym.make(ID, n_tendons=5)
    _, info = env.reset(seed=0)
    *_, later = env.step(env.action_space.sample())
    for values in (info, later):
        assert all(isinstance(value, np.generic) for value in values.values())


def test_gymnasiums_time_limit_can_only_shorten():
    env = gym.make(ID, max_episode_steps=3)
    env.reset(seed=0)
    assert [env.step(env.action_space.sample())[3] for _ in range(3)] == [False, False, True]
    with pytest.raises(ValueError, match="episode_steps makes episodes longer"):
        gym.make_vec(ID, num_envs=2, max_episode_steps=60)


def test_the_step_that_begins_an_episode_tells_its_first_observation_alone():
    """Also of robots that have to fail at once: these begin inside a bar."""
    keywords = {"num_envs": 16, "physics": "mujoco", "disturbances": "helical", "episode_steps": 2}
    envs = gym.make_vec("clarke_gym/Gate-v0", **keywords)
    envs.reset(seed=0)
    for k in range(9):
        begun = envs.unwrapped._done.copy()
        _, reward, terminated, truncated, _ = envs.step(np.zeros(envs.action_space.shape))
        assert (reward[begun] == 0.0).all()
        assert not (terminated | truncated)[begun].any()
        assert k % 3 != 2 or begun.any()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_shows_the_generator_of_its_episodes(copied):
    env = gym.make(ID)
    env.reset(seed=0)
    twin = copied(env)
    for each in (env, twin):
        each.unwrapped.np_random.random()
    for _ in range(20):  # more than are drawn at once
        np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])


def test_a_robots_file_is_found_from_another_directory(tmp_path, monkeypatch):
    (tmp_path / "arm.yaml").write_text("segments: [{n_tendons: 5}]")
    monkeypatch.chdir(tmp_path)
    env = gym.make(ID, robot="arm.yaml")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert copy.deepcopy(env).unwrapped.robot.n_joints == 5
