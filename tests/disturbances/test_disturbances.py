"""What disturbances do, against independent calculations."""

import pickle

import gymnasium as gym
import numpy as np
import pytest

from clarke_gym.disturbances import DISTURBANCES, PRESETS, parse
from clarke_gym.numerics.noise import normals, uniforms
from clarke_gym.physics.mujoco import MujocoPhysics
from clarke_gym.robots import Robot, make_robot
from clarke_gym.robots.joint_vector import JointVector

ID = "clarke_gym/Reach-v0"
OURS = [name for name in DISTURBANCES.names() if not name.startswith(("test_", "weak_"))]
PHYSICS = ["constant_curvature", "mujoco"]
CASES = [
    (physics, name)
    for physics in PHYSICS
    for name in (*OURS, "mild", "hardware", "harsh")
    if name in PRESETS or physics in DISTURBANCES[name].physics
]


@pytest.mark.parametrize(("physics", "name"), CASES)
def test_vector_equals_scalar_and_restoring_is_exact(physics, name):
    keywords = {
        "n_tendons": 4,
        "representation": "raw" if name == "harsh" else "clarke",
        "physics": physics,
        "disturbances": name,
        "sensors": "oracle",
    }
    env, envs = gym.make(ID, **keywords), gym.make_vec(ID, num_envs=3, **keywords)
    first, many = env.reset(seed=6)[0], envs.reset(seed=5)[0]
    np.testing.assert_array_equal(first, many[1])
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (24, *envs.action_space.shape)).astype(np.float32)
    kept, trace = None, []
    for k, action in enumerate(actions):
        if k == 10:
            kept = pickle.loads(pickle.dumps(env.unwrapped.state()))
        seen, reward, *_ = env.step(action[1])
        results = envs.step(action)
        np.testing.assert_array_equal(seen, results[0][1])
        assert reward == results[1][1]
        assert envs.observation_space.contains(results[0])
        trace.append(seen)
    other = gym.make(ID, **keywords)
    other.reset(seed=9)
    other.unwrapped.restore(kept)
    for k in range(10, 24):
        np.testing.assert_array_equal(other.step(actions[k][1])[0], trace[k])


@pytest.mark.parametrize("task", ["Nest", "Hold", "Wrap", "Shape"])
def test_tendons_of_ones_own_among_bodies_and_loads(task):
    env_id = f"clarke_gym/{task}-v0"
    keywords = {
        "n_tendons": 4,
        "physics": "mujoco",
        "disturbances": "hardware+harsh+helical+broken_tendon",
        "sensors": "oracle",
    }
    env, envs = gym.make(env_id, **keywords), gym.make_vec(env_id, num_envs=2, **keywords)
    np.testing.assert_array_equal(env.reset(seed=6)[0], envs.reset(seed=5)[0][1])
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1, 1, (8, *envs.action_space.shape)).astype(np.float32)
    seen, kept = [], None
    for k, action in enumerate(actions):
        if k == 4:
            kept = pickle.loads(pickle.dumps(env.unwrapped.state()))
        seen.append(env.step(action[1])[0])
        np.testing.assert_array_equal(seen[-1], envs.step(action)[0][1])
    assert np.isfinite(seen).all()
    other = gym.make(env_id, **keywords)
    other.reset(seed=1)
    other.unwrapped.restore(kept)
    for k in range(4, 8):
        np.testing.assert_array_equal(other.step(actions[k][1])[0], seen[k])


@pytest.mark.parametrize("name", OURS)
def test_a_disturbance_changes_something_and_goals_stay(name):
    physics = DISTURBANCES[name].physics[-1]
    traces = []
    for disturbances in (None, name):
        envs = gym.make_vec(
            ID,
            num_envs=8,  # a delay can be none
            n_tendons=4,
            physics=physics,
            disturbances=disturbances,
            representation="raw",
        )
        traces.append([envs.reset(seed=11)[0]])
        for _ in range(20):
            traces[-1].append(envs.step(np.tile(np.float32([0.5, -0.3, 0.1, 0.2]), (8, 1)))[0])
        goal = envs.unwrapped.sensors["goal"].place
    plain, disturbed = np.array(traces)
    assert np.abs(plain - disturbed).max() > 1e-4
    np.testing.assert_array_equal(plain[..., goal], disturbed[..., goal])


@pytest.mark.parametrize("name", ["misplacement", "unequal_radii"])
def test_another_layout_takes_the_shape_of_its_own_tendons(name):
    robot = make_robot(n_tendons=5)
    made = DISTURBANCES[name](robot, 6)
    numbers = np.random.default_rng(0).random((6, made.numbers))
    made.begin(np.arange(6), numbers, np.zeros((6, 5)))
    command = np.random.default_rng(1).normal(size=(6, 5)) * 1e-3
    told = made.step(command)
    angles, radii = made.layout(numbers)
    for k in range(6):
        own = (radii[k] / 0.01)[:, None] * np.stack([np.cos(angles[k]), np.sin(angles[k])], 1)
        shape = np.linalg.lstsq(own, command[k], rcond=None)[0]
        np.testing.assert_allclose(robot.encoder @ told[k], shape, rtol=0, atol=1e-12)
        left = command[k] - own @ shape  # what taut tendons cannot take up strains them
        left -= robot.decoder @ robot.encoder @ left
        np.testing.assert_allclose(told[k] - robot.decoder @ shape, left, rtol=0, atol=1e-12)


def test_a_helix_is_the_mean_of_parallel_tendons_along_it():
    robot = make_robot(n_tendons=4)
    made = DISTURBANCES["helical"](robot, 1)
    numbers = np.array([[0.9]])
    angles, radii = made.layout(numbers)
    turn = np.pi / 2 * 0.8
    along = (np.arange(20000) + 0.5) / 20000
    for theta in (0.0, 1.1):
        mean = 0.01 * np.cos(robot.segments[0].angles[:, None] + turn * along - theta).mean(1)
        np.testing.assert_allclose(radii[0] * np.cos(angles[0] - theta), mean, rtol=0, atol=1e-10)


def test_a_broken_tendon_is_left_out():
    robot = make_robot(n_tendons=4)
    made = DISTURBANCES["broken_tendon"](robot, 1)
    made.begin(np.array([0]), np.array([[0.3]]), np.zeros((1, 4)))
    one, other = np.zeros((1, 4)), np.array([[0.0, 5e-3, 0.0, 0.0]])
    np.testing.assert_allclose(
        made.step(one) @ robot.encoder.T, made.step(other) @ robot.encoder.T, atol=1e-15
    )


def moved(payload_kg=0.0, vary=None, **keywords):
    physics = MujocoPhysics(Robot(), 2, 0.05, payload_kg=payload_kg, **keywords)
    rows = np.arange(2)
    if vary is not None:
        physics.vary(rows, vary)
    physics.reset(rows, np.zeros((2, 1, 2)))
    command = JointVector.from_clarke(np.array([[[0.006, 0.002]]] * 2))
    for _ in range(20):
        physics.step(command)
    return physics.state.tip_position


def test_numbers_of_one_robot_in_a_batch_are_those_of_a_model_compiled_with_them():
    together = moved(vary={"payload_kg": np.array([0.0, 0.01])})
    for k, payload in enumerate((0.0, 0.01)):
        np.testing.assert_allclose(together[k], moved(payload)[k], rtol=0, atol=1e-8)
    tilted = moved(vary={"base_tilt_rad": np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]])})
    turned = (np.cos(0.15), np.sin(0.15), 0.0, 0.0)
    np.testing.assert_allclose(tilted[1], moved(base_quaternion=turned)[1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(tilted[0], moved()[0], rtol=0, atol=1e-12)


def test_a_force_bends_as_the_beam_says():
    physics = MujocoPhysics(Robot(), 1, 0.05, gravity_m_s2=(0.0, 0.0, 0.0), profile="accurate")
    physics.reset(np.array([0]), np.zeros((1, 1, 2)))
    physics.pull(np.array([[0.02, 0.0, 0.0]]))
    for _ in range(60):
        physics.step(JointVector.from_clarke(np.zeros((1, 1, 2))))
    # Tendons hold the summed bend: a rod whose end slides without turning, F l^3 / (12 E I).
    expected = 0.02 * 0.2**3 / (12.0 * 0.010183)
    assert physics.state.tip_position[0, 0] == pytest.approx(expected, rel=0.03)


def test_sensor_delay_tells_what_was_a_few_steps_ago():
    keywords = {"n_tendons": 4, "representation": "clarke", "sensors": "tip_position+hidden"}
    plain = gym.make(ID, n_tendons=4, representation="clarke", sensors="tip_position")
    late = gym.make(ID, disturbances="sensor_delay", **keywords)
    lags = set()
    for seed in range(12):
        true, told = [plain.reset(seed=seed)[0][:3]], [late.reset(seed=seed)[0][:3]]
        lag = int(np.floor(0.5 * (late.unwrapped._core.disturbances[0].drawn[0, 0]) * 6))
        lags.add(lag)
        for _ in range(8):
            action = np.array([0.9, -0.4], np.float32)
            true.append(plain.step(action)[0][:3])
            told.append(late.step(action)[0][:3])
        for k in range(9):
            np.testing.assert_allclose(told[k], true[max(k - lag, 0)], rtol=0, atol=1e-6)
    assert lags == {0, 1, 2}


@pytest.mark.parametrize("name", ["sensor_noise", "sensor_bias", "quantisation", "sensor_delay"])
def test_what_is_measured_is_disturbed_and_what_is_known_is_not(name):
    keywords = {"n_tendons": 5, "n_segments": 2}
    plain, disturbed = (gym.make(ID, disturbances=each, **keywords) for each in ("none", name))
    sensors, differ = disturbed.unwrapped.sensors, set()
    for seed in range(4):  # a delay may be none
        for env in (plain, disturbed):
            env.reset(seed=seed)
        for action in np.random.default_rng(0).uniform(-1, 1, (6, *plain.action_space.shape)):
            true, told = (env.step(action.astype(np.float32))[0] for env in (plain, disturbed))
            differ |= {each for each in sensors if (true != told)[sensors[each].place].any()}
    assert differ == {"displacement", "tip_position", "goal_gap"}


@pytest.mark.parametrize("representation", ["raw", "clarke", "clarke_common", "arc_polar"])
@pytest.mark.parametrize(
    "name",
    ["unequal_radii", "broken_tendon", "helical", "misplacement", "slack_tendon", "backlash"],
)
def test_observations_stay_in_their_space_whatever_the_drives_are_told(name, representation):
    keywords = {"n_tendons": 4, "representation": representation, "disturbances": name}
    envs = gym.make_vec(ID, num_envs=32, **keywords)
    envs.reset(seed=0)
    for action in np.random.default_rng(0).choice([-1.0, 1.0], (40, *envs.action_space.shape)):
        assert envs.observation_space.contains(envs.step(action)[0])


def test_measured_values_of_the_hardware_come_in_steps():
    env = gym.make(ID, disturbances="hardware").unwrapped
    tip = env.reset(seed=0)[0][env.sensors["tip_position"].place].astype(np.float64)
    steps = tip / (0.02 * 0.08)
    np.testing.assert_allclose(steps, np.round(steps), rtol=0, atol=1e-3)
    assert np.abs(steps).max() > 10.0


def test_noise_depends_on_key_place_and_stream_alone():
    keys, places = np.array([0.1, 0.7]), np.array([3, 9])
    both = normals(keys, places, 5, 2)
    np.testing.assert_array_equal(both[1], normals(keys[1:], places[1:], 5, 2)[0])
    assert not np.array_equal(both, normals(keys, places + 1, 5, 2))
    assert not np.array_equal(both, normals(keys, places, 5, 3))
    u = uniforms(np.linspace(0, 1, 400, endpoint=False), np.zeros(400, int), 50)
    assert 0.0 < u.min() < u.max() < 1.0
    assert np.abs(np.corrcoef(u.T) - np.eye(50)).max() < 0.25
    counts = np.histogram(u, 20, (0, 1))[0]
    assert np.abs(counts - 1000).max() < 5 * np.sqrt(1000)


def test_combinations_have_strengths_and_presets_leave_out_what_has_no_meaning():
    assert parse("payload=0.5 + push", "mujoco") == {"payload": 0.5, "push": 1.0}
    assert parse("none", "mujoco") == parse(None, "mujoco") == {}
    arcs, bodies = (set(parse("harsh", physics)) for physics in PHYSICS)
    assert arcs < bodies
    assert "payload" in bodies - arcs
    half, whole = parse("mild=2", "mujoco"), parse("mild", "mujoco")
    assert half == {name: 2.0 * value for name, value in whole.items()}


@pytest.mark.parametrize(
    ("text", "physics", "message"),
    [
        ("payload", "constant_curvature", "payload.*no meaning with physics='constant_curvature'"),
        ("capstan", "constant_curvature", "capstan.*no meaning"),
        ("paylod", "mujoco", "did you mean 'payload'"),
        ("payload=x", "mujoco", "strength of 'payload' must be a number"),
        ("payload=-1", "mujoco", "strength of 'payload' must be a number above 0"),
        ("backbone_stiffness=5", "mujoco", "'backbone_stiffness' must be at most 3, beyond which"),
        ("harsh=3", "mujoco", "'damping' must be at most 2.*got 'harsh=3', which makes it 3"),
        ("unequal_radii=8", "constant_curvature", "'unequal_radii' must be at most 4.5"),
        ("helical=4", "constant_curvature", "'helical' must be at most 3"),
    ],
)
def test_mistakes_are_named(text, physics, message):
    with pytest.raises(ValueError, match=message):
        gym.make(ID, physics=physics, disturbances=text)
