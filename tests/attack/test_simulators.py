"""Simulators and pictures across processes, and robots that cannot be."""

import multiprocessing

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym  # noqa: F401  (registers the environments)

pytestmark = pytest.mark.attack

ID = "clarke_gym/Reach-v0"


def in_a_forked_child(function):
    """Return what a function says in a forked child, or "hangs"."""
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()

    def run():
        try:
            theirs.send(function())
        except Exception as error:
            theirs.send(f"{type(error).__name__}: {error}")

    child = context.Process(target=run)
    child.start()
    said = ours.recv() if ours.poll(20.0) else "hangs"
    child.kill()
    child.join()
    return said


def test_a_threaded_batch_in_a_forked_child_is_refused_with_the_way_out():
    envs = gym.make_vec(ID, num_envs=4, physics="mujoco", threads=2)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    said = in_a_forked_child(lambda: envs.step(envs.action_space.sample()))
    assert said.startswith("RuntimeError: a MuJoCo batch on several threads does not survive")
    assert "threads=1" in said


def test_drawing_in_a_forked_child_of_a_process_that_has_drawn_is_refused():
    env = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
    env.reset(seed=0)
    env.render()

    def draw():
        other = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
        other.reset(seed=0)
        return other.render().shape

    assert "context='spawn'" in in_a_forked_child(draw)
    env.close()


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"n_tendons": 1_000_000}, "n_tendons must be at most 4096"),
        ({"n_segments": 1_000}, "n_segments must be at most 64"),
        ({"robot": {"segments": [{"length_m": 200.0}]}}, "in another unit"),
        ({"success_tolerance": 2.0}, "success_tolerance is a fraction"),
    ],
    ids=str,
)
def test_impossible_robots_and_tasks_are_refused(keywords, message):
    with pytest.raises(ValueError, match=message):
        gym.make(ID, **keywords)


@pytest.mark.parametrize("action", [["0.1", "0.2", "0.3"], [1j, 0.0, 0.0], [None, 0.0, 0.0]])
def test_actions_that_are_no_real_numbers_are_refused(action):
    env = gym.make(ID)
    env.reset(seed=0)
    with pytest.raises(TypeError, match="action must hold real numbers"):
        env.step(np.array(action))
