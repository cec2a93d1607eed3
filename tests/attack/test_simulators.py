"""Simulators and pictures across processes, and robots that cannot be."""

import gc
import multiprocessing
import subprocess
import sys
import weakref
from functools import partial

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.envs.core import EnvCore
from tests.attack.world import LONG

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
    said = ours.recv() if ours.poll(60.0) else "hangs"
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


def core(env):
    """Return what holds the physics and the pictures."""
    return next(x for x in vars(env.unwrapped).values() if isinstance(x, EnvCore))


@pytest.mark.parametrize("make", [gym.make, partial(gym.make_vec, num_envs=2)])
@pytest.mark.parametrize("id", [id for id in gym.registry if id.startswith("clarke_gym/")])
@pytest.mark.parametrize(
    "keywords", [{}, {"physics": "mujoco"}, {"disturbances": "backlash"}], ids=str
)
def test_a_forgotten_environment_is_freed_without_the_collector(make, id, keywords):
    """In a cycle, it and its simulators would stay until the collector happens to come."""
    env = make(id, **keywords)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    kept = weakref.ref(core(env))
    gc.disable()
    try:
        del env
        assert kept() is None
    finally:
        gc.enable()


MANY = """
import ctypes, gc, sys
import gymnasium as gym
import clarke_gym
from clarke_gym.rendering.thread import drawing_thread

name, times, vector, close, keywords = eval(sys.argv[1])
make = gym.make_vec if vector else gym.make


def memory_mb():
    gc.collect()
    drawing_thread().ask(int)  # it has freed what was forgotten before
    ctypes.CDLL(None).malloc_trim(0)
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6


def again(times):
    for _ in range(times):
        env = make("clarke_gym/Reach-v0", **keywords)
        env.reset(seed=0)
        env.step(env.action_space.sample())
        if close:
            env.close()
        else:
            env.render()


again(10)
before = memory_mb()
again(times)
print(memory_mb() - before)
"""

_SMALL = {"render_mode": "rgb_array", "render_width": 64, "render_height": 64}


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc, asks glibc")
@pytest.mark.parametrize(
    ("name", "vector", "close", "keywords"),
    [
        ("scalar, constant curvature", False, True, {}),
        ("batch, constant curvature", True, True, {"num_envs": 8}),
        ("scalar, MuJoCo", False, True, {"physics": "mujoco"}),
        ("batch, MuJoCo", True, True, {"num_envs": 8, "physics": "mujoco", "threads": 1}),
        ("batch, 4 threads", True, True, {"num_envs": 8, "physics": "mujoco", "threads": 4}),
        ("scalar, drawn and forgotten", False, False, _SMALL),
        ("batch, drawn and forgotten", True, False, {"num_envs": 2} | _SMALL),
    ],
)
def test_environments_made_again_and_again_hold_no_memory(
    request, name, vector, close, keywords, figure
):
    """The allocator keeps some of what is freed, so it is asked to give it back first."""
    if not close:
        request.getfixturevalue("offscreen")
    times = 300 if LONG else 25 if close else 8
    arguments = [sys.executable, "-c", MANY, repr((name, times, vector, close, keywords))]
    done = subprocess.run(arguments, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    grown = float(done.stdout)
    figure(f"{name}, {times} times: {grown:+.1f} MB")
    assert grown < (30.0 if LONG else 10.0)
