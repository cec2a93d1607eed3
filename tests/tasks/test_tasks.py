"""What the tasks promise: goals that can be had, clear ways, scores that mean something."""

from itertools import pairwise

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clarke_gym import kinematics
from clarke_gym.control import make_controller
from clarke_gym.registration import ENVIRONMENTS
from clarke_gym.representations import make_representation
from clarke_gym.robots import make_robot
from clarke_gym.robots.scene import Capsule, Scene, body_distance
from clarke_gym.tasks import TASKS, Nest
from clarke_gym.tasks.paths import PATHS
from clarke_gym.tasks.track import LONGEST_S

IDS = [name for name, keywords in ENVIRONMENTS.items() if keywords]
PLANNED = ["Reach", "Pose", "Track", "Shape", "Gate", "Nest"]


def played(env_id, agent, episodes=24, seed=100, **keywords):
    """Return the last infos of some episodes, and which of them failed."""
    keywords = {"n_tendons": 5, "representation": "clarke", **keywords}
    envs = gym.make_vec(env_id, num_envs=episodes, autoreset_mode="disabled", **keywords)
    observation, info = envs.reset(seed=seed)
    envs.action_space.seed(0)
    controller = None if agent == "random" else make_controller(agent, envs)
    failed = np.zeros(episodes, bool)
    for _ in range(envs.unwrapped.episode_steps):
        action = envs.action_space.sample() if controller is None else controller.act(observation)
        observation, _, terminated, truncated, info = envs.step(action)
        failed |= terminated
        if terminated.any() and not (terminated | truncated).all():
            observation, _ = envs.reset(options={"reset_mask": terminated})
    return info, failed


@pytest.mark.parametrize("name", PLANNED)
def test_a_task_is_neither_trivial_nor_impossible(name):
    info, failed = played(f"clarke_gym/{name}-v0", "clarke_controller")
    assert (info["is_success"] & ~failed).mean() >= 0.9
    info, failed = played(f"clarke_gym/{name}-v0", "random")
    assert (info["is_success"] & ~failed).mean() <= 0.05


@pytest.mark.parametrize("env_id", IDS)
def test_one_physical_command_sequence_has_the_same_rewards_in_every_representation(env_id):
    rng = np.random.default_rng(0)
    rewards = []
    for representation in ("clarke", "raw", "rotated"):
        env = gym.make(env_id, n_tendons=4, representation=representation)
        robot, control = env.unwrapped.robot, rng.__class__(np.random.PCG64(7))
        coded = make_representation(representation, robot)
        env.reset(seed=5)
        rewards.append([])
        for _ in range(40):
            pairs = control.uniform(-0.5, 0.5, 2 * robot.n_segments)
            action = coded.encode((robot.decoder @ pairs)[None])[0]
            rewards[-1].append(env.step(action.astype(np.float32))[1])
    np.testing.assert_allclose(rewards[1], rewards[0], rtol=0, atol=2e-4)
    np.testing.assert_allclose(rewards[2], rewards[0], rtol=0, atol=2e-4)


@pytest.mark.parametrize("env_id", [i for i in IDS if "Wrap" not in i])
@pytest.mark.parametrize("reward", ["dense", "sparse"])
def test_rewards_can_be_asked_of_observed_goals(env_id, reward):
    env = gym.make(env_id, n_tendons=4, representation="clarke", goal_env=True, reward=reward)
    env.reset(seed=1)
    env.action_space.seed(1)
    for _ in range(30):
        seen, given_reward, terminated, _, info = env.step(env.action_space.sample())
        asked = env.unwrapped.compute_reward(seen["achieved_goal"], seen["desired_goal"], info)
        assert asked == given_reward
        if terminated:
            env.reset()


@pytest.mark.parametrize("env_id", IDS)
def test_dense_rewards_and_their_terms_are_in_the_unit_interval_and_add_up(env_id):
    env = gym.make(env_id, n_tendons=4)
    env.reset(seed=2)
    env.action_space.seed(2)
    for _ in range(40):
        _, reward, terminated, _, info = env.step(env.action_space.sample())
        terms = [value for name, value in info.items() if name.startswith("reward_")]
        assert 0.0 <= reward <= 1.0
        assert sum(terms) == pytest.approx(reward, abs=1e-12)
        if terminated:
            env.reset()


ARMS = {
    "one": {},
    "two": {"n_segments": 2},
    "three": {"n_segments": 3},
    "hardware": {"robot": "hardware"},
    "fast": {"pitch_radius_m": 0.004},
    "stiff": {"max_bending_rad": 0.5},
    "uneven": {"robot": {"segments": [{"max_bending_rad": 1.5}, {"max_bending_rad": 0.5}]}},
}


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("name", PATHS)
@given(seed=st.integers(0, 2**31), share=st.floats(0.05, 1.0))
def test_paths_keep_to_the_bending_limit_and_to_their_share_of_the_speed(name, arm, seed, share):
    robot = make_robot(**ARMS[arm])
    path = PATHS[name](robot, LONGEST_S)
    told = path.make(np.random.default_rng(seed).random((8, path.numbers)), share)
    times = np.arange(0.0, 4.0, 0.05)
    every = path.at(np.tile(told, (len(times), 1)), np.repeat(times, 8))
    shapes = every.reshape(len(times), 8, *every.shape[1:])
    assert (np.hypot(shapes[..., 0], shapes[..., 1]) <= robot.max_bending).all()
    clarke = kinematics.bending_to_clarke(shapes, robot.pitch_radii)
    moved = np.diff(clarke, axis=0)
    speed = np.hypot(moved[..., 0], moved[..., 1]) / 0.05 / robot.tendon_speeds
    assert speed.max() <= share * (1.0 + 1e-9)


@pytest.mark.parametrize("name", ["gate", "nest"])
@pytest.mark.parametrize("segments", [1, 2, 3])
@pytest.mark.parametrize("difficulty", [0.0, 0.5, 1.0])
def test_every_episode_among_bodies_has_a_clear_start_and_goal(name, segments, difficulty):
    robot = make_robot(n_segments=segments)
    task = TASKS[name](robot, difficulty=difficulty)
    numbers = np.random.default_rng(segments).random((40, task.numbers))
    start, parameters = task.begin(numbers)
    places = task.places(parameters)
    assert task.gaps(task.leg(start, start), places).min() > 0.0
    tip_gap = body_distance(parameters[:, None, :3], places).min(1) - task.hull_m
    assert tip_gap.min() > 0.0
    if name == "gate":  # the known way: straighten, bend
        straight = np.zeros_like(start)
        assert task.gaps(task.leg(start, straight), places).min() > 0.0


@pytest.mark.parametrize(
    "keywords",
    [{}, {"robot": "two_segment"}, {"pitch_radius_m": 0.004, "max_bending_rad": 3.0}],
    ids=["default", "two_segment", "slender"],
)
def test_the_known_way_through_a_nest_is_clear_between_the_looks_at_it_too(keywords):
    robot = make_robot(**keywords)
    task, segments = Nest(robot, difficulty=1.0), robot.n_segments
    numbers = np.random.default_rng(0).random((100, task.numbers))
    places = task.places(task.begin(numbers)[1])
    ends = numbers[:, : 6 * segments].reshape(100, 3, segments, 2)
    shapes = np.moveaxis(kinematics.sample_dome(ends, robot.max_bending), 1, 0)
    share = np.linspace(0.0, 1.0, 240)[:, None, None]
    for row in range(100):
        legs = [a[row] * (1.0 - share) + b[row] * share for a, b in pairwise(shapes)]
        curves = kinematics.backbone(np.concatenate(legs), robot.lengths, 40)
        assert task.gaps(curves.reshape(1, -1, 3), places[row : row + 1]).min() > 0.0


@pytest.mark.parametrize("most", [0.3, 0.6, 0.9])
def test_a_gate_is_refused_to_robots_that_cannot_get_out_of_it(most):
    with pytest.raises(ValueError, match=r"to get out of Gate's ring of bars.*max_bending_rad"):
        gym.make("clarke_gym/Gate-v0", max_bending_rad=most, difficulty=0.0)


def test_a_gate_that_is_too_hard_for_a_robot_is_refused_and_it_keeps_the_other():
    env = gym.make("clarke_gym/Gate-v0", max_bending_rad=1.1, difficulty=0.0)
    bars = env.unwrapped.task.bar_radius_m
    with pytest.raises(ValueError, match="at difficulty 1"):
        env.unwrapped.set_difficulty(1.0)
    assert (env.unwrapped.difficulty, env.unwrapped.task.bar_radius_m) == (0.0, bars)


def test_shapes_of_a_gate_keep_every_segments_limit():
    robot = make_robot({"segments": [{"max_bending_rad": 0.6}, {"max_bending_rad": 1.6}]})
    task = TASKS["gate"](robot, difficulty=0.5)
    starts, _ = task.begin(np.random.default_rng(0).random((60, task.numbers)))
    assert (np.hypot(starts[..., 0], starts[..., 1]) <= robot.max_bending * (1 + 1e-12)).all()


@pytest.mark.parametrize("difficulty", [0.0, 1.0])
def test_goals_of_a_gate_lie_outside_its_ring(difficulty):
    task = TASKS["gate"](make_robot(max_bending_rad=1.3), difficulty=difficulty)
    start, parameters = task.begin(np.random.default_rng(0).random((200, task.numbers)))
    for tips in (parameters, task.tips(start)):
        out = np.hypot(tips[:, 0], tips[:, 1])
        assert out.min() > 0.07 + task.bar_radius_m + task.hull_m


def test_a_direction_that_is_asked_for_is_one():
    env = gym.make("clarke_gym/Pose-v0")
    observation, _ = env.reset(seed=0, options={"goal": [0.0, 0.0, 0.4, 0.0, 0.0, 5.0]})
    assert env.observation_space.contains(observation)
    assert env.unwrapped.goal[0].round(6).tolist() == [0.0, 0.0, 0.4, 0.0, 0.0, 1.0]
    with pytest.raises(ValueError, match="directions other than zero"):
        env.reset(options={"goal": [0.0, 0.0, 0.4, 0.0, 0.0, 0.0]})


def test_a_nest_has_as_many_bodies_as_its_difficulty_says_and_other_ones_every_episode():
    counts = []
    for difficulty in (0.0, 0.5, 1.0):
        task = Nest(make_robot("two_segment"), difficulty=difficulty)
        numbers = np.random.default_rng(0).random((20, task.numbers))
        places = task.places(task.begin(numbers)[1])
        in_play = places[..., 2] > -task.robot.length_m
        counts.append(in_play.sum(1).max())
        assert in_play.sum(1).max() <= task.n_bodies
        assert np.ptp(places[:, :, 0], axis=0).max() > 0.05
    assert counts == sorted(counts)
    assert counts[0] < counts[-1]


@given(
    ends=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
    points=st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3),
)
def test_distances_to_capsules_are_those_to_their_nearest_points(ends, points):
    numbers = np.array([[*ends, 0.1]])
    share = np.linspace(0.0, 1.0, 20001)[:, None]
    axis = numbers[0, :3] * (1.0 - share) + numbers[0, 3:6] * share
    nearest = np.linalg.norm(axis - np.array(points), axis=1).min() - 0.1
    found = body_distance(np.array([points]), numbers)[0]
    assert found == pytest.approx(nearest, abs=2e-4)


@pytest.mark.parametrize("physics", ["constant_curvature", "mujoco"])
def test_bodies_of_a_batch_are_where_each_episode_has_them(physics):
    envs = gym.make_vec("clarke_gym/Nest-v0", num_envs=4, physics=physics)
    envs.reset(seed=0)
    bodies = envs.unwrapped.physics.state.bodies
    assert len(np.unique(bodies[:, :, 0])) > 8
    for k in range(4):
        env = gym.make("clarke_gym/Nest-v0", physics=physics)
        env.reset(seed=k)
        np.testing.assert_array_equal(env.unwrapped.physics.state.bodies[0], bodies[k])


@pytest.mark.parametrize("env_id", ["clarke_gym/Gate-v0", "clarke_gym/Nest-v0"])
def test_where_nothing_touches_the_two_physics_agree(env_id):
    envs = [
        gym.make_vec(env_id, num_envs=8, physics=physics, representation="clarke", n_tendons=4)
        for physics in ("constant_curvature", "mujoco")
    ]
    for each in envs:
        each.reset(seed=3)
    physics = envs[1].unwrapped.physics
    weightless, _ = np.zeros((8, 3)), physics._steps._whole  # so that both engines are there
    for engine in physics._engines():
        engine.model_field("opt.gravity")[:] = weightless
    free = np.ones(8, bool)
    rng = np.random.default_rng(0)
    for k in range(45):
        action = rng.uniform(-0.2, 0.2, envs[0].action_space.shape).astype(np.float32)
        action *= k < 25  # then come to rest: swinging two segments were 1.1 % apart
        clear = [each.step(action)[-1]["clearance_m"] for each in envs]
        free &= np.min(clear, axis=0) > 0.002
        tips = [each.unwrapped.physics.state.tip_position for each in envs]
        gap = np.linalg.norm(tips[0] - tips[1], axis=1) / envs[0].unwrapped.robot.length_m
        assert gap[free].max() < (0.01 if k == 44 else 0.02)
    assert free.sum() >= 3


def test_robots_pressed_against_bodies_do_not_sink_in():
    """With MuJoCo's default softness, or half of it, they lie 0.8 mm and more inside."""
    robots = 48
    envs = gym.make_vec(
        "clarke_gym/Nest-v0",
        num_envs=robots,
        n_tendons=4,
        physics="mujoco",
        representation="clarke",
        control="absolute",
    )
    envs.reset(seed=3)
    turn = np.linspace(0.0, 2.0 * np.pi, robots, endpoint=False)
    bent = np.tile(np.stack([np.cos(turn), np.sin(turn)], axis=1), (1, 2))
    for _ in range(40):
        *_, info = envs.step(np.float32(bent))
    force = envs.unwrapped.physics.state.contact_force
    assert (force > 0.1).sum() >= 5
    assert force.max() > 1.0
    assert -5e-4 < info["clearance_m"][force > 0.0].min() < 0.0


def test_failure_is_a_body_too_deep_inside():
    env = gym.make("clarke_gym/Gate-v0", representation="clarke", control="absolute")
    env.reset(seed=0)
    deep = env.unwrapped.task.hull_m
    ended = False
    for angle in np.linspace(0.0, 2.0 * np.pi, 60):  # round through the bars
        action = np.array([np.cos(angle), np.sin(angle)], np.float32)
        _, reward, ended, _, info = env.step(action)
        assert ended == (-info["clearance_m"] > deep * (1.0 + 1e-6))
        if ended:
            assert reward == 0.0
            break
    assert ended


def test_difficulty_is_a_number_or_a_name_and_changes_what_begins_next():
    env = gym.make("clarke_gym/Track-v0", difficulty="easy")
    face = env.unwrapped
    env.reset(seed=0)
    speeds = []
    for difficulty in ("easy", 0.5, "hard"):
        face.set_difficulty(difficulty)
        env.reset(seed=0)
        first = face.goal[0]
        env.step(np.zeros(3))
        speeds.append(np.linalg.norm(face.goal[0] - first))
    assert face.difficulty == 1.0
    assert speeds[0] < speeds[1] < speeds[2]
    for bad, error in (("extreme", ValueError), (1.5, ValueError), (True, TypeError)):
        with pytest.raises(error, match="difficulty"):
            face.set_difficulty(bad)
        with pytest.raises(error, match="difficulty"):
            gym.make("clarke_gym/Reach-v0", difficulty=bad)


def test_metrics_of_whole_episodes_are_means_roots_and_extremes():
    env = gym.make("clarke_gym/Track-v0", representation="clarke")
    _, info = env.reset(seed=4)
    errors, hits = [], []
    rng = np.random.default_rng(0)
    for step in range(30):
        *_, info = env.step(rng.uniform(-1, 1, 2).astype(np.float32))
        env.unwrapped.render()  # asks for the same state again, which must not count twice
        errors.append(info["tip_error_m"])
        hits.append(info["is_success"])
        assert info["on_target"] == pytest.approx(np.mean(hits)), step
        assert info["tip_error_rms_m"] == pytest.approx(np.sqrt(np.mean(np.square(errors))))
    gate = gym.make("clarke_gym/Gate-v0", representation="clarke")
    _, info = gate.reset(seed=0)
    least = info["clearance_m"]
    for _ in range(10):
        *_, info = gate.step(np.array([0.1, 0.05], np.float32))
        least = min(least, info["clearance_m"])
        assert info["least_clearance_m"] == least


def test_the_preview_shows_where_the_target_will_be():
    env = gym.make("clarke_gym/Track-v0", representation="clarke")
    seen, _ = env.reset(seed=0)
    block = env.unwrapped.sensors["preview"]
    foretold = (seen[block.place] * block.scale).reshape(2, 3)
    for k in range(2):
        env.step(np.zeros(2))
        np.testing.assert_allclose(env.unwrapped.goal[0], foretold[k], rtol=0, atol=1e-7)


def test_holding_pays_effort_and_loads_pull():
    env = gym.make("clarke_gym/Hold-v0", representation="clarke_common", difficulty="hard")
    env.reset(seed=0)
    for _ in range(20):
        *_, info = env.step(np.array([0.0, 0.0, 0.0], np.float32))
    idle = info["effort"]
    assert info["tip_error_m"] > 0.001
    for _ in range(20):
        *_, info = env.step(np.array([0.0, 0.0, 1.0], np.float32))
    assert info["effort"] > idle


def test_a_bend_towards_the_cylinder_winds_round_it_and_one_away_does_not():
    env = gym.make("clarke_gym/Wrap-v0", representation="clarke", control="absolute")
    wound = []
    for sign in (0.8, -0.8):
        env.reset(seed=1)
        body = env.unwrapped.physics.state.bodies[0, 0]
        towards = 0.5 * (body[:2] + body[3:5])
        towards = sign * towards / np.linalg.norm(towards)
        for _ in range(60):
            *_, info = env.step(np.tile(towards, 2).astype(np.float32))
        wound.append(info["wound_rad"])
    assert wound[0] > 2.0
    assert wound[1] < 0.5


def test_a_body_is_a_sphere_where_both_ends_are_one_point():
    ball, bar = Capsule((0, 0, 1), (0, 0, 1), 0.1), Capsule((0, 0, 1), (0, 1, 1), 0.1)
    assert ball.is_sphere
    assert not bar.is_sphere
    assert Scene((ball, bar)).numbers.shape == (2, 7)
    assert Scene().numbers.shape == (0, 7)
