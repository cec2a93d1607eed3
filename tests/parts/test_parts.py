"""Parts that are added from outside: tasks, sensors, disturbances, representations, robots."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import clarke_gym
from clarke_gym.representations import REPRESENTATIONS
from clarke_gym.robots.scene import Capsule, Scene

BAR = Capsule((0.04, -0.2, 0.13), (0.04, 0.2, 0.13), 0.01)
"""Across the way of a robot that bends towards +x."""


@clarke_gym.register_task("test_orbit")
class Orbit(clarke_gym.GoalTask):
    """A goal that moves, a scene, and an end by failure: everything Reach does not have."""

    max_episode_steps = 30
    numbers = 2

    def __init__(self, robot, *, bars=1, tolerance_m=0.01):
        super().__init__(robot)
        self.tolerance_m = tolerance_m
        self.goal = clarke_gym.Goal(("x", "y", "z"), "m", scale=robot.length_m)
        self.metrics = (
            clarke_gym.Metric("tip_error_m", "tip error", "m", 0.4),
            clarke_gym.Metric("clearance_m", "clearance", "m", -1.0),
        )
        self.scene = Scene((BAR,) * bars)

    def draw(self, rng):  # by rejection: no two episodes need as many numbers
        while True:
            numbers = rng.random(2)
            if numbers[0] > 0.5:
                return numbers

    def begin(self, numbers):
        return np.zeros((len(numbers), self.robot.n_segments, 2)), numbers

    def advance(self, parameters, time_s):
        angle = 2.0 * np.pi * (parameters[:, 1] + 0.5 * time_s)
        radius = 0.05 * parameters[:, 0]
        height = np.full_like(angle, 0.18)
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=1)

    def achieved(self, state):
        return state.tip_position

    def score(self, achieved, desired):
        error = np.linalg.norm(achieved - desired, axis=1)
        return clarke_gym.Outcome(-error, error < self.tolerance_m, {"tip_error_m": error})

    def evaluate(self, state, goal):
        outcome = super().evaluate(state, goal)
        clearance = state.clearance
        outcome.metrics = {**outcome.metrics, "clearance_m": clearance}
        outcome.failure = clearance < -0.005
        return outcome


ORBIT = {"task": "test_orbit", "n_tendons": 4, "representation": "clarke"}
PHYSICS = ["constant_curvature", "mujoco"]


def make(**keywords):
    return gym.make("clarke_gym/Task-v0", **{**ORBIT, **keywords})


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize("disturbances", [None, "backlash"])
@pytest.mark.parametrize("goal_env", [False, True])
def test_a_task_of_ones_own_is_an_environment_like_any_other(physics, disturbances, goal_env):
    keywords = {"physics": physics, "disturbances": disturbances, "goal_env": goal_env}
    env = make(**keywords)
    check_env(env, skip_render_check=True)
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    twin = pickle.loads(pickle.dumps(env))
    vector = gym.make_vec("clarke_gym/Task-v0", num_envs=3, **ORBIT, **keywords)
    first = [env.reset(seed=6)[0], again.reset(seed=6)[0], twin.reset(seed=6)[0]]
    seen = vector.reset(seed=5)[0]
    rng = np.random.default_rng(0)
    for _ in range(29):
        action = rng.uniform(-1.0, 1.0, 2).astype(np.float32)
        row = {k: v[1] for k, v in seen.items()} if goal_env else seen[1]
        for each in (*first[1:], row):
            for a, b in zip(
                first[0].values() if goal_env else [first[0]],
                each.values() if goal_env else [each],
                strict=True,
            ):
                np.testing.assert_array_equal(a, b)
        steps = [other.step(action) for other in (env, again, twin)]
        results = vector.step(np.tile(action, (3, 1)))
        assert steps[0][1] == steps[1][1] == steps[2][1] == results[1][1]
        first, seen = [step[0] for step in steps], results[0]


@pytest.mark.parametrize("physics", PHYSICS)
def test_a_moving_goal_is_where_the_clock_says_and_survives_restoring(physics):
    env = make(physics=physics, disturbances="backlash")
    env.reset(seed=3)
    goals = []
    for step in range(20):
        if step == 10:
            state = pickle.loads(pickle.dumps(env.unwrapped.state()))
        env.step(np.array([0.3, -0.4], np.float32))
        goals.append(env.unwrapped.goal[0])
    other = make(physics=physics, disturbances="backlash")
    other.reset(seed=8)
    other.unwrapped.restore(state)
    for step in range(10, 20):
        ours = other.step(np.array([0.3, -0.4], np.float32))[0]
        np.testing.assert_array_equal(other.unwrapped.goal[0], goals[step])
    np.testing.assert_array_equal(ours[7:10], (goals[-1] / 0.2).astype(np.float32))
    turned = np.arctan2(*np.array(goals).T[1::-1])
    step_rad = np.mod(np.diff(turned), 2.0 * np.pi)
    np.testing.assert_allclose(step_rad, 2.0 * np.pi * 0.5 * 0.05, rtol=1e-5)


def pressed(physics, bars):
    env = make(physics=physics, task="test_orbit", bars=bars, episode_steps=60)
    env.reset(seed=0)
    least = np.inf
    for _ in range(50):
        *_, info = env.step(np.array([0.4, 0.0], np.float32))
        least = min(least, info["clearance_m"])
    return env.unwrapped.physics.state, least


def test_bodies_stop_a_robot_in_mujoco_and_tell_by_clearance_in_constant_curvature():
    free, _ = pressed("mujoco", 0)
    held, gap = pressed("mujoco", 1)
    assert held.tip_position[0, 0] < free.tip_position[0, 0] - 0.01
    assert held.contact_force[0] > 0.05
    assert free.contact_force[0] == 0.0
    assert -1.5e-3 < gap < 1e-3  # soft contact, no tunnel
    arc, gap = pressed("constant_curvature", 1)
    assert arc.tip_position[0, 0] > held.tip_position[0, 0] + 0.01
    assert gap < -0.005


def test_where_nothing_touches_bodies_change_nothing():
    traces = []
    for bars in (0, 1):
        env = make(physics="mujoco", bars=bars, sim_dt_s=2.5e-3)
        env.reset(seed=0)
        for _ in range(20):
            env.step(np.array([-0.5, 0.3], np.float32))
        traces.append(env.unwrapped.physics.state.tip_position)
    np.testing.assert_allclose(traces[0], traces[1], rtol=0.0, atol=1e-9)


def test_failure_ends_an_episode():
    env = make(episode_steps=200, control="absolute")
    env.reset(seed=0)
    for _ in range(60):
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0], np.float32))
        assert terminated == (info["clearance_m"] < -0.005)
        if terminated:
            break
    assert terminated
    assert not info["diverged"]


def test_backlash_swallows_small_motions_and_its_gap_is_drawn_anew():
    env = gym.make(
        "clarke_gym/Reach-v0",
        n_tendons=4,
        representation="clarke",
        disturbances="backlash",
        random_start=False,
    )
    reached = []
    for seed in (0, 1):
        env.reset(seed=seed)
        for _ in range(3):
            env.step(np.array([0.1, 0.0], np.float32))
        state = env.unwrapped.physics.state
        assert abs(state.displacement[0, 0]) < abs(state.command[0, 0])
        reached.append(state.displacement[0, 0])
    assert reached[0] != reached[1]
    plain = gym.make("clarke_gym/Reach-v0", n_tendons=4)
    plain.reset(seed=1)
    env.reset(seed=1)  # what disturbs does not change the goals
    np.testing.assert_array_equal(env.unwrapped.goal, plain.unwrapped.goal)


@pytest.mark.parametrize("representation", ["raw", "clarke", "clarke_common"])
def test_every_sensor_reads_what_its_table_says(representation):
    names = "command+tendons+velocity+tension+tip+backbone+clearance"
    env = gym.make(
        "clarke_gym/Reach-v0",
        physics="mujoco",
        n_tendons=4,
        n_segments=2,
        representation=representation,
        sensors=names,
    )
    env.reset(seed=0)
    for _ in range(10):
        observation = env.step(0.3 * env.action_space.sample())[0]
    face, state = env.unwrapped, env.unwrapped.physics.state
    assert observation.shape == (sum(len(block.labels) for block in face.sensors.values()),)
    tip = face.sensors["tip_position"]
    np.testing.assert_allclose(
        observation[tip.place] * tip.scale, state.tip_position[0], rtol=0, atol=1e-7
    )
    tension = face.sensors["tension"]
    expected = face.observation_representation.encode(state.tension / tension.scale)[0]
    expected = np.clip(expected, -tension.high, tension.high)
    np.testing.assert_allclose(observation[tension.place], expected, rtol=0, atol=1e-6)
    velocity = face.sensors["velocity"]
    expected = face.observation_representation.encode(state.velocity / velocity.scale)[0]
    expected = np.clip(expected, -velocity.high, velocity.high)
    np.testing.assert_allclose(observation[velocity.place], expected, rtol=0, atol=1e-6)
    table = face.sensors.table()
    assert len(table.splitlines()) == 2 + len(observation)
    assert "| tension | 1.1 | N | 10 |" in table


def no_task(**_):
    return None


@pytest.mark.parametrize(
    ("keywords", "error", "message"),
    [
        ({"n_tendon": 3}, TypeError, "did you mean 'n_tendons'"),
        ({"profile": "fast"}, ValueError, "profile needs physics='mujoco', got profile='fast'"),
        ({"bars": 2}, ValueError, "bars needs task='test_orbit'"),
        ({"sensors": "tension"}, ValueError, "needs tension, which physics='constant_curvature'"),
        ({"sensors": "tip_positon"}, ValueError, "did you mean 'tip_position'"),
        ({"disturbances": "backlsh"}, ValueError, "did you mean 'backlash'"),
        ({"representation": "clark"}, ValueError, "did you mean 'clarke'"),
        ({"robot": "two_segments"}, ValueError, "did you mean 'two_segment'"),
        ({"robot": "missing.yaml"}, ValueError, "cannot be read"),
        ({"robot": {"segments": [{"pitch_radius_m": 10.0}]}}, ValueError, "in another unit"),
        ({"robot": {"segments": [{"lenght_m": 0.2}]}}, ValueError, "did you mean 'length_m'"),
        ({"robot": "hardware", "n_tendons": 4}, ValueError, "would lose where the tendons"),
        ({"task": "reech"}, ValueError, "did you mean 'reach'"),
        ({"episode_steps": 0}, ValueError, "episode_steps"),
        ({"random_start": 1}, TypeError, "random_start must be true or false"),
        ({"segment_length_m": 200.0}, ValueError, "length_m must be a number from 0.001 to 10 m"),
        ({"pitch_radius_m": 1e-5}, ValueError, "pitch_radius_m must be a number from 0.0001"),
        (
            {"pitch_radius_m": 1e-4, "physics": "mujoco"},
            ValueError,
            "bend a backbone of diameter 0.0014 m by 5.56 % of what they are told",
        ),
        (
            {"payload_kg": 5.0, "physics": "mujoco"},
            ValueError,
            "is more than this robot can be simulated under: at most 0.258 kg",
        ),
        (
            {"robot": {"segments": [{"disk_mass_kg": 0.5}]}, "physics": "mujoco"},
            ValueError,
            "of this robot of 0.2 m are by 4.",
        ),
    ],
    ids=str,
)
def test_mistakes_are_named_with_the_nearest_name_and_the_owner(keywords, error, message):
    with pytest.raises(error, match=message):
        gym.make("clarke_gym/Task-v0", **keywords)


@clarke_gym.register_task("test_needs_contact")
class NeedsContact(Orbit):
    needs = ("contact_force",)


def test_a_task_that_needs_contact_says_which_physics_has_it():
    with pytest.raises(ValueError, match=r"needs contact_force.*\['mujoco'\] do"):
        make(task="test_needs_contact")
    make(task="test_needs_contact", physics="mujoco").close()


def test_names_are_registered_once():
    with pytest.raises(ValueError, match="task 'reach' is registered already"):
        clarke_gym.register_task("reach")(Orbit)
    with pytest.raises(ValueError, match="representation 'clarke' is registered already"):
        clarke_gym.register_representation("clarke", lambda segment: segment.matrices)
    with pytest.raises(ValueError, match="a robot needs a name of letters"):
        clarke_gym.register_robot("our arm", {})
    with pytest.raises(TypeError, match="a task is a subclass of Task"):
        clarke_gym.register_task("test_function")(no_task)


def test_a_class_has_one_name_and_names_that_mean_more_are_kept():
    with pytest.raises(ValueError, match="Orbit is the task 'test_orbit' already; register a sub"):
        clarke_gym.register_task("test_orbit_again")(Orbit)
    for kind, name in (("sensor", "tip"), ("sensor", "oracle"), ("disturbance", "harsh")):
        base = clarke_gym.TaskSensor if kind == "sensor" else clarke_gym.Disturbance
        decorator = getattr(clarke_gym, f"register_{kind}")(name)
        with pytest.raises(ValueError, match=f"{kind} '{name}' stands for something else"):
            decorator(type("Mine", (base,), {}))


def test_a_representation_must_be_what_the_registry_says(monkeypatch):
    monkeypatch.setattr(REPRESENTATIONS, "_entries", dict(REPRESENTATIONS._entries))
    clarke_gym.register_representation("test_transposed", lambda segment: segment.matrices)
    with pytest.raises(ValueError, match=r"shapes \(5, k\) and \(k, 5\)"):
        gym.make("clarke_gym/Reach-v0", n_tendons=5, representation="test_transposed")
    clarke_gym.register_representation(
        "test_blind", lambda segment: (np.eye(segment.n_tendons), np.eye(segment.n_tendons) * 0.0)
    )
    with pytest.raises(ValueError, match="does not see both directions"):
        gym.make("clarke_gym/Reach-v0", representation="test_blind")


@clarke_gym.register_task("test_plain")
class Plain(clarke_gym.Task):
    """No numbers are drawn, and what is told is the state's own memory, to read."""

    metrics = (clarke_gym.Metric("height_m", "height", "m", 0.0),)

    def begin(self, numbers):
        return np.zeros((len(numbers), self.robot.n_segments, 2)), np.zeros((len(numbers), 0))

    def evaluate(self, state, goal):
        height = state.tip_position[:, 2]
        reward = np.broadcast_to(1.0, height.shape)
        return clarke_gym.Outcome(reward, height > 0.0, {"height_m": height}, {"height": height})


@pytest.mark.parametrize("physics", ["constant_curvature", "mujoco"])
@pytest.mark.parametrize("mode", ["next_step", "same_step"])
def test_a_task_may_tell_what_it_sees_as_it_is(physics, mode):
    keywords = {"task": "test_plain", "physics": physics, "episode_steps": 3}
    envs = gym.make_vec("clarke_gym/Task-v0", num_envs=2, autoreset_mode=mode, **keywords)
    observation, info = envs.reset(seed=0)
    for _ in range(9):
        info["height_m"][:] = info["reward_height"][:] = -1.0
        observation, reward, _, _, info = envs.step(np.zeros(envs.action_space.shape))
        z = envs.unwrapped.sensors["tip_position"].place.start + 2
        np.testing.assert_allclose(observation[:, z] * 0.2, info["height_m"], rtol=1e-6)
        np.testing.assert_allclose(info["height_m"], 0.2, rtol=0.01)
        reward[:] = 5.0
    scalar = gym.make("clarke_gym/Task-v0", **keywords)
    scalar.reset(seed=0)
    assert scalar.step(np.zeros(3, np.float32))[1] == 1.0
