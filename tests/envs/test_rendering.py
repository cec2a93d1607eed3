"""Pictures: shape, what they show, headless, recording, and clear errors."""

import copy
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import gymnasium as gym
import numpy as np
import pytest

from clarke_gym import kinematics
from clarke_gym.rendering import picture as rendering
from clarke_gym.rendering import room as _scene
from clarke_gym.robots.presets import make_robot
from clarke_gym.tasks.reach import Reach

ID = "clarke_gym/Reach-v0"
PHYSICS = ["constant_curvature", "mujoco"]


def near(image, colour, tolerance=60):
    """Count the pixels close to a colour, brightness aside."""
    pixels = image.reshape(-1, 3).astype(float)
    pixels /= np.maximum(pixels.max(axis=1, keepdims=True), 1.0)
    target = np.array(colour[:3]) / max(colour[:3])
    return int((np.abs(pixels - target).max(axis=1) < tolerance / 255).sum())


@pytest.mark.usefixtures("offscreen")
@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("representation", ["raw", "clarke"])
def test_picture_has_the_asked_size_and_changes_with_the_robot(physics, representation):
    env = gym.make(
        ID,
        physics=physics,
        representation=representation,
        n_tendons=5,
        render_mode="rgb_array",
        render_width=120,
        render_height=90,
    )
    env.reset(seed=0)
    first = env.render()
    assert first.shape == (90, 120, 3)
    assert first.dtype == np.uint8
    for _ in range(5):
        env.step(np.ones(env.action_space.shape, np.float32) * [1] + 0 * env.action_space.sample())
    for _ in range(5):
        env.step(env.action_space.sample())
    second = env.render()
    assert (first != second).any()
    env.close()
    env.close()


@pytest.mark.usefixtures("offscreen")
def test_goal_is_orange_and_turns_green_on_success():
    env = gym.make(ID, random_start=False, render_mode="rgb_array", success_tolerance=0.5)
    env.reset(seed=0, options={"goal": [0.06, 0.06, 0.17]})
    reached = env.render()
    env.close()
    env = gym.make(ID, random_start=False, render_mode="rgb_array")
    env.reset(seed=0, options={"goal": [0.06, 0.06, 0.17]})
    missed = env.render()
    env.close()
    assert near(missed, rendering.GOAL) > near(reached, rendering.GOAL) + 20
    assert near(reached, rendering.REACHED) > near(missed, rendering.REACHED) + 20


@pytest.mark.usefixtures("offscreen")
def test_tendons_are_coloured_by_load():
    robot = make_robot(n_tendons=5)
    picture = rendering.Picture(robot, 200, 200)
    curve = kinematics.backbone(np.array([[0.8, 0.3]]), robot.lengths, 10)
    slack, _ = picture.draw(curve, 10, np.zeros(5))
    taut, _ = picture.draw(curve, 10, np.ones(5))
    picture.close()
    assert near(taut, rendering.TAUT) > 100 > near(slack, rendering.TAUT)
    assert near(slack, rendering.SLACK) > 100 > near(taut, rendering.SLACK)


@pytest.mark.usefixtures("offscreen")
def test_slack_and_tight_tendons_differ_on_mujoco():
    env = gym.make(ID, physics="mujoco", n_tendons=4, random_start=False, render_mode="rgb_array")
    env.reset(seed=0)
    pictures = []
    for action in ([0.0, 0.0, 0.0, 0.0], [1.0, -1.0, 1.0, -1.0]):
        for _ in range(10):
            env.step(np.array(action, np.float32))
        pictures.append(env.render())
    env.close()
    rest, fighting = pictures  # two tendons against the other two: two tight, two slack
    assert near(fighting, rendering.SLACK, 40) > near(rest, rendering.SLACK, 40) + 100
    assert near(fighting, rendering.TAUT, 40) > near(rest, rendering.TAUT, 40) + 100


@pytest.mark.usefixtures("offscreen")
def test_bodies_are_drawn_where_the_episode_put_them():
    env = gym.make("clarke_gym/Nest-v0", render_mode="rgb_array", random_start=False)
    pictures = []
    for seed in (0, 1):
        env.reset(seed=seed)
        pictures.append(env.render())
    env.close()
    green = [near(picture, rendering.BODY, 25) for picture in pictures]
    assert min(green) > 200
    assert green[0] != green[1]


@pytest.mark.usefixtures("offscreen")
@pytest.mark.parametrize("size", [(200, 200), (300, 150), (150, 300)])
@pytest.mark.parametrize("segments", [1, 2, 3, 5])
def test_the_arm_fills_the_picture_and_stays_inside(segments, size):
    robot = make_robot(n_segments=segments)
    picture = rendering.Picture(robot, *size)
    straight = np.zeros((10 * segments + 1, 3))
    straight[:, 2] = np.linspace(0.0, robot.length_m, len(straight))
    there, _ = picture.draw(straight, 10, np.ones(robot.n_joints))
    gone, _ = picture.draw(1e-3 * straight, 10, np.ones(robot.n_joints))
    picture.close()
    changed = np.abs(there.astype(int) - gone).max(axis=2) > 40
    rows = np.flatnonzero(changed.any(axis=1))
    assert rows.min() > 0.02 * size[1]
    floor, _ = _scene.room(robot)
    share = robot.length_m / (robot.length_m - floor)
    square = min(1.0, size[0] / size[1])
    assert np.ptp(rows) > 0.42 * share * square * size[1]


@pytest.mark.usefixtures("offscreen")
def test_depth_is_in_metres():
    env = gym.make(ID, random_start=False, render_mode="depth_array")
    env.reset(seed=0)
    depth = env.render()
    assert depth.shape == (480, 480)
    assert depth.dtype == np.float32
    # The camera looks at the middle of the arm, which is about that far away.
    floor, reach = _scene.room(make_robot())
    away = _scene.camera_distance(0.2 - floor, reach, 1.0)
    assert depth[240, 240] == pytest.approx(away, abs=0.03)
    env.close()


@pytest.mark.usefixtures("offscreen")
def test_vector_environment_gives_one_picture_each_like_the_scalars():
    envs = gym.make_vec(ID, num_envs=3, render_mode="rgb_array", render_width=64, render_height=64)
    envs.reset(seed=4)
    frames = envs.render()
    envs.close()
    assert len(frames) == 3
    env = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
    env.reset(seed=6)
    np.testing.assert_array_equal(env.render(), frames[2])
    env.close()


@pytest.mark.usefixtures("offscreen")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_record_video_works(tmp_path):
    pytest.importorskip("moviepy")
    env = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
    env = gym.wrappers.RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda k: True)
    env.reset(seed=0)
    for _ in range(50):
        _, _, _, truncated, _ = env.step(env.action_space.sample())
    assert truncated
    env.close()
    assert [path.suffix for path in (tmp_path / "videos").iterdir()] == [".mp4"]


def test_no_opengl_names_the_packages(monkeypatch):
    def missing(name):
        raise ImportError(f"no {name}")

    monkeypatch.setattr(_scene.importlib, "import_module", missing)
    with pytest.raises(RuntimeError, match=r"libegl1.*libosmesa6.*no mujoco.egl"):
        rendering.Picture(make_robot(), 32, 32)


def test_sizes_are_checked():
    with pytest.raises(ValueError, match="render_width must be a whole number from 16"):
        gym.make(ID, render_width=0)


def test_transported_frames_follow_the_kinematics():
    bending = np.array([[0.9, -0.5], [-0.4, 0.7]])
    lengths = [0.2, 0.2]
    curve = kinematics.backbone(bending, lengths, 200)
    x, y = rendering.transported_frames(curve)
    _, quaternion = kinematics.forward(bending, lengths)
    np.testing.assert_allclose(
        x[-1], kinematics.rotate(quaternion, np.array([1.0, 0, 0])), atol=0.01
    )
    np.testing.assert_allclose(
        y[-1], kinematics.rotate(quaternion, np.array([0, 1.0, 0])), atol=0.01
    )


@pytest.mark.usefixtures("offscreen")
def test_any_thread_draws_and_the_callers_own_context_stays():
    """A window's context is current in the caller's thread while it asks for pictures."""
    env = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
    env.reset(seed=0)
    first = env.render()
    with ThreadPoolExecutor(1) as other:
        second = other.submit(env.render).result()
    np.testing.assert_array_equal(first, second)
    env.close()


@pytest.mark.usefixtures("offscreen")
def test_a_forked_process_is_told_that_it_cannot_draw(monkeypatch):
    env = gym.make(ID, render_mode="rgb_array", render_width=64, render_height=64)
    env.reset(seed=0)
    env.render()
    with monkeypatch.context() as forked:
        forked.setattr(rendering.os, "getpid", lambda: -1)
        with pytest.raises(RuntimeError, match="do not survive a fork"):
            env.render()
    env.close()


@pytest.mark.parametrize("segments", [1, 2, 3, 4, 5])
def test_every_goal_is_above_the_floor_and_inside_the_picture(segments):
    robot = make_robot(n_segments=segments)
    floor, reach = _scene.room(robot)
    task = Reach(robot)
    _, goals = task.begin(np.random.default_rng(0).random((5000, task.numbers)))
    assert floor < goals[:, 2].min() < 1.0
    assert np.hypot(goals[:, 0], goals[:, 1]).max() <= reach * (1.0 + 1e-12)


@pytest.mark.usefixtures("offscreen")
def test_many_tendons_and_segments_fit_into_the_scene():
    robot = make_robot(n_segments=5, n_tendons=40)
    picture = rendering.Picture(robot, 64, 64)
    curve = np.zeros((51, 3))
    curve[:, 2] = np.linspace(0.0, robot.length_m, 51)
    rgb, _ = picture.draw(curve, 10, np.zeros(robot.n_joints), (0.0, 0.1, 0.3))
    assert near(rgb, rendering.GOAL) > 0
    picture.close()


@pytest.mark.usefixtures("offscreen")
@pytest.mark.parametrize("physics", PHYSICS)
def test_the_window_shows_the_picture_above_the_representations(physics, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame = pytest.importorskip("pygame")
    env = gym.make(ID, physics=physics, representation="clarke", render_mode="human")
    plain = gym.make(ID, physics=physics, representation="clarke")
    np.testing.assert_array_equal(env.reset(seed=3)[0], plain.reset(seed=3)[0])
    action = np.array([1.0, -0.5], np.float32)
    np.testing.assert_array_equal(env.step(action)[0], plain.step(action)[0])
    shown = pygame.surfarray.array3d(pygame.display.get_surface())
    assert shown.shape == (480, 480, 3)
    assert shown.std() > 10  # something is drawn
    env.close()


FORGETFUL = """
import gc, threading
import gymnasium as gym
import clarke_gym
from clarke_gym.rendering.thread import drawing_thread

gc.set_threshold(50)  # forgotten pictures are found in the middle of others


def memory_mb():
    return int(open("/proc/self/statm").read().split()[1]) * 4096 / 1e6


def forget(times, vector):
    for _ in range(times):
        make = gym.make_vec if vector else gym.make
        size = {"render_width": 64, "render_height": 64}
        env = make("clarke_gym/Reach-v0", render_mode="rgb_array", **size)
        env.reset(seed=0)
        env.render()
        ring = [env]
        ring.append(ring)  # only the collector finds it


def at_once():
    threads = [threading.Thread(target=forget, args=(4, k % 2)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    gc.collect()
    drawing_thread().ask(int)  # what was asked before is done


at_once()
before = memory_mb()
at_once()
at_once()
print(memory_mb() - before)
"""


@pytest.mark.usefixtures("offscreen")
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_forgotten_pictures_are_freed_from_any_thread_and_nothing_stops():
    """32 more environments that nobody closes; each held 50 MB and more until then."""
    done = subprocess.run(
        [sys.executable, "-c", FORGETFUL], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert float(done.stdout) < 400.0


AT_EXIT = """
import atexit, time
from clarke_gym.rendering.thread import drawing_thread

thread = drawing_thread()
thread.ask(atexit.register, print, "the backend is closed")  # as MuJoCo does where it loads one
thread.tell(time.sleep, 0.3)
thread.tell(print, "the picture is freed")
"""


def test_what_is_left_to_free_at_exit_comes_before_the_backend_closes():
    command = [sys.executable, "-c", AT_EXIT]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["the picture is freed", "the backend is closed"]


def test_a_push_is_drawn_while_it_lasts_and_not_after_a_reset():
    size = {"render_mode": "rgb_array", "render_width": 96, "render_height": 96}
    keywords = {"physics": "mujoco", "disturbances": "push=10", "representation": "clarke", **size}
    used, fresh = (gym.make("clarke_gym/Reach-v0", **keywords) for _ in range(2))
    used.reset(seed=4)
    for _ in range(30):
        used.step(np.zeros(2, np.float32))
        if np.abs(used.unwrapped._core._pulled).max() > 0.0:
            break
    twin = copy.deepcopy(used)
    np.testing.assert_array_equal(used.render(), twin.render())
    for env in (used, fresh):
        env.reset(seed=5)
    np.testing.assert_array_equal(used.render(), fresh.render())
