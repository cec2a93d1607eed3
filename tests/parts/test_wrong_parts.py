"""Parts of users' that do what no part may: they are refused, by name."""

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym
from clarke_gym.physics import PHYSICS, physics_class, register_physics
from clarke_gym.physics.base import RobotState
from clarke_gym.physics.constant_curvature import ConstantCurvature
from clarke_gym.representations import register_representation
from clarke_gym.representations.registry import clarke_layout
from clarke_gym.robots import Robot
from clarke_gym.robots.scene import Capsule, Scene

pytestmark = pytest.mark.usefixtures("registries")

BODY = (0.1, 0.0, 0.1, 0.1, 0.0, 0.1)


class Plain(clarke_gym.Task):
    numbers = 2

    def begin(self, numbers):
        return np.zeros((len(numbers), self.robot.n_segments, 2)), numbers

    def evaluate(self, state, goal):
        error = np.linalg.norm(state.tip_position[:, :2], axis=1)
        return clarke_gym.Outcome(-error, error < 0.01)


def begin(env_id, num_envs=None, **keywords):
    make = gym.make if num_envs is None else gym.make_vec
    env = make(env_id, **keywords | ({} if num_envs is None else {"num_envs": num_envs}))
    env.reset(seed=0)
    return env.step(np.ones(env.action_space.shape))[0]


def starts(value):
    return lambda self, numbers: (np.full((len(numbers), 1, 2), value), numbers)


def outcome(**changes):
    def evaluate(self, state, goal):
        told = {"reward": np.zeros(len(goal)), "success": np.zeros(len(goal), bool)}
        return clarke_gym.Outcome(**told | changes)

    return evaluate


METRIC = clarke_gym.Metric("held", "time held", "s", 0.0)
SCENE = Scene((Capsule(BODY[:3], BODY[3:], 0.01),), placed=True)


def wider(self, parameters):
    return np.tile([*BODY, 0.02], (len(parameters), 1, 1))


def nan_force(self, parameters, time_s):
    return np.full((len(parameters), 3), np.nan)


WRONG = {
    "start_nan": (
        {"begin": starts(np.nan)},
        "starts of task 'wrong_start_nan' must hold finite numbers",
    ),
    "start_far": ({"begin": starts(50.0)}, "times as far as max_bending_rad lets it"),
    "start_flat": (
        {"begin": lambda self, numbers: (np.zeros((len(numbers), 2)), numbers)},
        r"starts of task .* must be an array of the shape \(\d+, 1, 2\)",
    ),
    "no_outcome": (
        {"evaluate": lambda self, state, goal: None},
        "must return an Outcome, got None",
    ),
    "reward_float": ({"evaluate": outcome(reward=1.0)}, r"reward of the outcome .* got 1\.0"),
    "reward_column": (
        {"evaluate": outcome(reward=np.zeros((3, 1)))},
        r"reward of the outcome .* must be an array of the shape \(\d,\), got the shape \(3, 1\)",
    ),
    "success_bool": ({"evaluate": outcome(success=True)}, "success of the outcome"),
    "no_metric": ({"metrics": (METRIC,)}, r"declares the metrics \['held'\]"),
    "other_radius": ({"scene": SCENE, "places": wider}, "bodies of other radii than its scene has"),
}


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("vector", [False, True])
def test_tasks_that_tell_what_no_task_may_are_refused(name, vector):
    members, message = WRONG[name]
    clarke_gym.register_task(f"wrong_{name}")(type(name, (Plain,), members))
    keywords = {"task": f"wrong_{name}", "n_tendons": 4}
    with pytest.raises(ValueError, match=message) as error:
        begin("clarke_gym/Task-v0", 3 if vector else None, **keywords)
    assert f"wrong_{name}" in str(error.value)


def test_a_force_that_is_no_number_is_refused():
    clarke_gym.register_task("wrong_force")(type("Pulls", (Plain,), {"force": nan_force}))
    env = gym.make("clarke_gym/Task-v0", task="wrong_force", physics="mujoco")
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"task 'wrong_force' must hold finite"):
        env.step(np.zeros(3))


class TellsNan(clarke_gym.Disturbance):
    def step(self, command):
        return command * np.nan


class TellsOne(clarke_gym.Disturbance):
    def step(self, command):
        return command[:, :1]


class SensesOne(clarke_gym.Disturbance):
    def sense(self, name, scale, values):
        return values[:, :1]


class WritesIntoWhatItGets(clarke_gym.Disturbance):
    def sense(self, name, scale, values):
        values += 0.01
        return values


@pytest.mark.parametrize(
    ("name", "part", "message"),
    [
        ("wrong_nan", TellsNan, "command of disturbance 'wrong_nan' must hold finite numbers"),
        ("wrong_shape", TellsOne, r"'wrong_shape' must be an array of the shape \(1, 3\)"),
        ("wrong_sense", SensesOne, r"'wrong_sense' must be an array of the shape"),
    ],
)
def test_disturbances_that_return_anything_else_are_refused(name, part, message):
    clarke_gym.register_disturbance(name)(part)
    with pytest.raises(ValueError, match=message):
        begin("clarke_gym/Reach-v0", disturbances=name)


def test_a_disturbance_may_write_into_what_it_is_given():
    clarke_gym.register_disturbance("wrong_in_place")(WritesIntoWhatItGets)
    true, disturbed = (
        gym.make("clarke_gym/Reach-v0", disturbances=name) for name in (None, "wrong_in_place")
    )
    tips = []
    for env in (true, disturbed):
        env.reset(seed=0)
        env.step(np.ones(3))
        tips.append(env.unwrapped.physics.state.tip_position)
    np.testing.assert_array_equal(*tips)


class ForgetsItsAxis(clarke_gym.TaskSensor):
    unit = "m"
    labels = ("x", "y", "z")
    scale = 1.0

    def read(self, state, goal):
        return state.tip_position[:, 0]


def test_a_sensor_of_the_wrong_shape_is_refused():
    clarke_gym.register_sensor("wrong_rows")(ForgetsItsAxis)
    envs = gym.make_vec("clarke_gym/Reach-v0", num_envs=3, sensors="command+wrong_rows")
    with pytest.raises(
        ValueError, match=r"'wrong_rows' .*the shape \(3, 3\), got the shape \(3,\)"
    ):
        envs.reset(seed=0)


def test_representations_that_bend_nowhere_or_are_in_another_unit_are_refused():
    def still(segment):
        encoder, decoder = segment.matrices
        return 0.0 * decoder, encoder

    # What is observed alone need not bend anything; one tendon near the middle is no other unit.
    register_representation("wrong_still", still)
    gym.make("clarke_gym/Reach-v0", observation_representation="wrong_still")
    register_representation("near_middle", clarke_layout(np.arange(4) * 1.6, [1e-2] * 3 + [9e-4]))
    gym.make("clarke_gym/Reach-v0", n_tendons=4, representation="near_middle")
    register_representation("wrong_unit", clarke_layout(np.arange(3) * 2.0, 10.0))
    for name, message in (("still", "does not bend"), ("unit", "in another unit")):
        with pytest.raises(ValueError, match=message):
            gym.make("clarke_gym/Reach-v0", representation=f"wrong_{name}")


# --- physics ----------------------------------------------------------------------------------


class Fresh(ConstantCurvature):
    """Makes a state each time that it is asked."""

    @property
    def state(self):
        return RobotState(self, self._displacement, *self._chain()[1][-1], self._never)


@pytest.fixture
def fresh(registries):
    register_physics("test_fresh", Fresh)
    return "test_fresh"


@pytest.mark.parametrize("env_id", ["clarke_gym/Reach-v0", "clarke_gym/Track-v0"])
def test_a_physics_need_not_keep_its_state(fresh, env_id):
    envs = [gym.make(env_id, physics=name, n_tendons=4) for name in ("constant_curvature", fresh)]
    rng = np.random.default_rng(0)
    seen = [env.reset(seed=0)[0] for env in envs]
    for _ in range(5):
        np.testing.assert_array_equal(*seen)
        action = rng.uniform(-1.0, 1.0, 4)
        seen = [env.step(action)[0] for env in envs]


def test_what_changes_commands_and_sensors_alone_disturbs_any_physics(fresh):
    env = gym.make("clarke_gym/Reach-v0", physics=fresh, disturbances="harsh")
    names = {disturbance.name for disturbance in env.unwrapped._core.disturbances}
    assert {"backlash", "sensor_noise", "command_delay"} <= names
    assert "payload" not in names
    with pytest.raises(ValueError, match="'payload' has no meaning with physics='test_fresh'"):
        gym.make("clarke_gym/Reach-v0", physics=fresh, disturbances="payload")


class HandsOn:
    """A physics that has most of another's."""

    KEYWORDS = ()
    OFFERS = ()

    def __init__(self, *arguments, **keywords):
        self._other = ConstantCurvature(*arguments, **keywords)

    def __getattr__(self, name):
        return getattr(vars(self)["_other"], name)


def test_a_physics_may_hand_on_what_another_has():
    register_physics("test_hands_on", HandsOn)
    names = ("test_hands_on", "constant_curvature")
    seen = [begin("clarke_gym/Reach-v0", physics=name) for name in names]
    np.testing.assert_array_equal(*seen)


@pytest.mark.parametrize(
    ("model", "reason"),
    [
        (5, "must be a class .* got 5"),
        ("nonsense", "a text 'module:Class', got 'nonsense'"),
        (ConstantCurvature(Robot(), 1, 0.05), "must be a class"),
        (type("Empty", (), {}), r"Empty lacks \['KEYWORDS', 'OFFERS', 'rest', 'reset', 'step'"),
    ],
)
def test_what_is_no_physics_is_refused(model, reason):
    with pytest.raises(TypeError, match=f"physics 'wrong_physics' .*{reason}"):
        register_physics("wrong_physics", model)
    assert "wrong_physics" not in PHYSICS


def test_a_physics_that_cannot_be_loaded_spoils_no_other_message():
    for _ in range(2):  # the same place is no other one
        register_physics("wrong_module", "".join(["no_such_module", ":Physics"]))
    with pytest.raises(ModuleNotFoundError):
        physics_class("wrong_module")
    with pytest.raises(TypeError, match="did you mean 'n_tendons'"):
        gym.make("clarke_gym/Reach-v0", n_tendon=3)
    with pytest.raises(ValueError, match=r"needs tension.*\['mujoco'\] do"):
        gym.make("clarke_gym/Reach-v0", sensors="command+tension")


def test_parts_that_want_the_same_keyword_are_refused():
    class Clash(Plain):
        def __init__(self, robot, *, threads=3):
            super().__init__(robot)

    clarke_gym.register_task("wrong_clash")(Clash)
    gym.make("clarke_gym/Task-v0", task="wrong_clash", threads=2)
    message = r"'threads' is of task='wrong_clash' and of physics='mujoco'"
    with pytest.raises(ValueError, match=message):
        gym.make("clarke_gym/Task-v0", task="wrong_clash", physics="mujoco", threads=2)


class Narrow(Plain):
    """Its episodes are impossible from difficulty 0.6 on."""

    def begin(self, numbers):
        bend = np.full((len(numbers), 1, 2), 0.1 if self.difficulty < 0.6 else 9.0)
        return bend, numbers


def test_a_difficulty_whose_episodes_are_refused_changes_nothing():
    clarke_gym.register_task("wrong_narrow")(Narrow)
    env = gym.make("clarke_gym/Task-v0", task="wrong_narrow")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="times as far as max_bending_rad"):
        env.unwrapped.set_difficulty(0.7)
    assert env.unwrapped.difficulty == 0.5
    for _ in range(40):  # more than are prepared at once
        env.reset()
