"""Classical controllers solve Reach through any representation, on both physics."""

import gymnasium as gym
import numpy as np
import pytest

import clarke_gym
from agents.learning.config import EnvSettings
from agents.learning.evaluation import HeldOutEvaluation
from clarke_gym.control.controllers import (
    CONTROLLERS,
    Gains,
    TipController,
    make_controller,
)
from clarke_gym.control.curl import TIGHTER, CurlController, curl
from clarke_gym.control.manifold_interface import ManifoldInterface
from clarke_gym.control.mppi import MppiController, MppiSettings
from clarke_gym.kinematics import bending_to_clarke
from clarke_gym.physics.base import hull_radius
from clarke_gym.representations import representation_names
from clarke_gym.robots import make_robot
from clarke_gym.wrappers import ClarkeAction


def errors(name, goals=100, **kwargs):
    """Return tip errors [% of length] on held-out goals."""
    evaluation = HeldOutEvaluation(EnvSettings(kwargs=kwargs), goals)
    result = evaluation.run(make_controller(name, evaluation.env))
    evaluation.close()
    return result["tip_error_percent"]


@pytest.mark.parametrize("n", [3, 4, 7, 11, 32])
@pytest.mark.parametrize("segments", [1, 2, 3, 4, 5])
def test_every_held_out_goal_is_reached_whatever_the_number_of_tendons(n, segments):
    representation = "raw" if n % 2 else "clarke"
    found = errors(
        "clarke_controller", n_tendons=n, n_segments=segments, representation=representation
    )
    assert found.max() < 1.0


NARROW = ("random_basis", "modal", "clarke_bends")
"""Representations whose box cannot ask for full speed in every direction."""


@pytest.mark.parametrize("name", [n for n in representation_names() if n not in NARROW])
def test_the_representation_makes_no_difference(name):
    kwargs = {"n_tendons": 4, "n_segments": 2, "goals": 20}
    plain = errors("clarke_controller", **kwargs)
    coded = errors("clarke_controller", representation=name, **kwargs)
    np.testing.assert_allclose(coded, plain, rtol=0, atol=0.01)


@pytest.mark.parametrize("name", NARROW)
def test_what_is_observed_in_a_narrow_one_makes_no_difference(name):
    kwargs = {"n_tendons": 4, "n_segments": 2, "goals": 20}
    plain = errors("clarke_controller", **kwargs)
    coded = errors("clarke_controller", observation_representation=name, **kwargs)
    np.testing.assert_allclose(coded, plain, rtol=0, atol=0.01)


@pytest.mark.parametrize("control", ["increment", "absolute"])
@pytest.mark.parametrize("goal_env", [False, True])
def test_both_controls_and_both_forms_of_observation(control, goal_env):
    kwargs = {"control": control, "goal_env": goal_env, "observation_representation": "clarke"}
    assert errors("clarke_controller", 30, n_tendons=5, **kwargs).max() < 0.1


@pytest.mark.parametrize(("n", "segments"), [(3, 1), (7, 1), (4, 2), (11, 3), (7, 4), (3, 5)])
def test_mujoco_within_three_percent(n, segments):
    kwargs = {"n_tendons": n, "n_segments": segments, "physics": "mujoco"}
    assert errors("clarke_controller", 40, **kwargs).max() < 3.0


def test_the_tips_correction_pays_on_mujoco():
    kwargs = {"n_tendons": 3, "n_segments": 2, "physics": "mujoco"}
    with_tip, without = (
        errors(name, 20, **kwargs) for name in ("clarke_controller", "clarke_model_only")
    )
    assert np.median(with_tip) < 0.3 * np.median(without)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_controller_solves_one_segment_and_acts_inside_the_space(name):
    env = gym.make_vec("clarke_gym/Reach-v0", num_envs=8, n_tendons=7, representation="clarke")
    controller = make_controller(name, env)
    observation, info = env.reset(seed=3)
    for _ in range(49):
        action = controller.act(observation)
        assert env.action_space.contains(action)
        observation, _, _, _, info = env.step(action)
    # Plans by samples settle to about their noise.
    assert info["tip_error_percent"].max() < (2.0 if name == "mppi" else 1.0)


def test_a_single_environment_gets_single_actions():
    env = gym.make("clarke_gym/Reach-v0", n_tendons=5)
    controller = make_controller("clarke_controller", env)
    observation, info = env.reset(seed=1)
    for _ in range(50):
        observation, _, _, truncated, info = env.step(controller.act(observation))
    assert truncated
    assert info["tip_error_percent"] < 0.1


def test_a_new_goal_in_the_same_row_is_planned_anew():
    env = gym.make_vec("clarke_gym/Reach-v0", num_envs=4, n_tendons=5)
    controller = make_controller("clarke_controller", env)
    observation, info = env.reset(seed=2)
    for _ in range(2 * 51 - 1):  # two episodes and the step that starts the second
        observation, _, _, _, info = env.step(controller.act(observation))
    assert info["tip_error_percent"].max() < 1.0


def test_the_law_is_the_sheets_proportional_loop_on_the_manifold():
    """One step: the command moves by Kp (target - M_P rho) dt, tendons never leave the manifold."""
    env = gym.make("clarke_gym/Reach-v0", n_tendons=7, random_start=False)
    observation, _ = env.reset(seed=0, options={"goal": np.array([0.004, 0.001, 0.1999])})
    controller = TipController(env, Gains(proportional=2.0, tip_memory_s=0.0))
    action = controller.act(observation)
    robot = env.unwrapped.robot
    target = bending_to_clarke(controller._target, robot.pitch_radii)[0, 0]
    step = robot.max_tendon_speed_m_s * 0.05
    np.testing.assert_allclose(
        robot.encoder @ action * step, 2.0 * 0.05 * target, rtol=0, atol=1e-9
    )
    np.testing.assert_allclose(robot.decoder @ robot.encoder @ action, action, rtol=0, atol=1e-7)


def test_observations_are_read_in_si_units():
    env = gym.make("clarke_gym/Reach-v0", robot="slim", observation_representation="clarke")
    observation, _ = env.reset(seed=4)
    now = ManifoldInterface(env).sense(observation)
    face = env.unwrapped
    np.testing.assert_allclose(now.achieved, face.physics.state.tip_position, rtol=0, atol=1e-7)
    np.testing.assert_allclose(now.goal, face.goal, rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        now.displacement, face.physics.state.displacement_vector.clarke, rtol=0, atol=1e-8
    )


def test_curling_lays_what_is_above_the_axis_on_the_cylinder():
    robot, radius = make_robot("two_segment", max_bending_rad=3.0), 0.03
    bar = np.array(
        [[0.0, 0.1, 0.15, 0.0, 0.1, 0.15, radius], [0.1, 0.0, 0.25, 0.1, 0.0, 0.25, 0.2]]
    )
    first, second = curl(robot, bar)
    around = TIGHTER / (radius + hull_radius(robot))
    np.testing.assert_allclose(first, [[0.0, 0.05 * around], [0.0, 3.0]], rtol=1e-12)
    np.testing.assert_allclose(second[0], 0.0, atol=1e-12)  # below the axis
    assert second[1, 0] == pytest.approx(TIGHTER * 0.15 / (0.2 + hull_radius(robot)))


def test_curling_winds_round_every_cylinder_and_holds_against_the_pull():
    env = gym.make_vec("clarke_gym/Wrap-v0", num_envs=4, n_tendons=3, representation="clarke")
    controller = make_controller("clarke_controller", env)
    assert isinstance(controller, CurlController)
    observation, info = env.reset(seed=11)
    for _ in range(80):  # the pull begins after 60
        observation, _, _, _, info = env.step(controller.act(observation))
    assert info["is_success"].all()
    with pytest.raises(ValueError, match="Reach has none"):
        CurlController(gym.make("clarke_gym/Reach-v0"))


def test_mistakes_are_named():
    env = gym.make("clarke_gym/Reach-v0")
    with pytest.raises(ValueError, match="controller must be one of"):
        make_controller("pid", env)
    with pytest.raises(TypeError, match="needs a clarke_gym environment"):
        make_controller("clarke_controller", gym.make("CartPole-v1"))


def test_a_planner_knows_the_difficulty_and_the_bodies_of_now():
    env = gym.make("clarke_gym/Gate-v0", representation="clarke", difficulty=0.0)
    env.unwrapped.set_difficulty(1.0)
    observation, _ = env.reset(seed=0)
    planner = MppiController(env, MppiSettings(samples=8, horizon=3))
    planner.act(observation)
    ours, imagined = env.unwrapped, planner._imagined._core
    np.testing.assert_array_equal(imagined.physics.state.bodies[5], ours.physics.state.bodies[0])
    assert imagined.task.success_tolerance == ours.task.success_tolerance
    bars = ours.physics.state.bodies[0]
    ours.set_difficulty(0.0)  # the episode that runs keeps its bars
    planner.act(observation)
    np.testing.assert_array_equal(imagined.physics.state.bodies[5], bars)


@pytest.mark.parametrize("segments", [1, 2, 3])
@pytest.mark.parametrize("random_start", [False, True])
def test_resolved_rate_goes_to_the_goal_and_not_to_its_mirror_image(segments, random_start):
    """Before its steps were slowed down, two straight segments missed three goals of four."""
    envs = gym.make_vec(
        "clarke_gym/Reach-v0",
        num_envs=64,
        n_tendons=5,
        n_segments=segments,
        representation="clarke",
        random_start=random_start,
        episode_steps=201,
    )
    controller, (observation, _) = make_controller("resolved_rate", envs), envs.reset(seed=3)
    for _ in range(200):
        observation, *_, info = envs.step(controller.act(observation))
    assert info["is_success"].mean() >= (0.95 if random_start and segments > 1 else 1.0)


class Circle(clarke_gym.GoalTask):
    """A position that moves; what shapes achieve is not told."""

    numbers = 1

    def __init__(self, robot):
        super().__init__(robot)
        self.goal = clarke_gym.Goal(("x", "y", "z"), "m", scale=robot.length_m)
        self.metrics = (clarke_gym.Metric("tip_error_m", "tip error", "m", 0.4),)

    def begin(self, numbers):
        return np.zeros((len(numbers), self.robot.n_segments, 2)), numbers

    def advance(self, parameters, time_s):
        angle = 2.0 * np.pi * parameters[:, 0] + 0.5 * time_s
        radius = 0.05 + 0.0 * angle
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), 3.8 * radius], axis=1)

    def achieved(self, state):
        return state.tip_position

    def score(self, achieved, desired):
        error = np.linalg.norm(achieved - desired, axis=1)
        return clarke_gym.Outcome(-error, error < 0.005, {"tip_error_m": error})


class Slope(Circle):
    """Its goal is no position."""

    def __init__(self, robot):
        super().__init__(robot)
        self.goal = clarke_gym.Goal(("a", "b", "c"), "1", scale=1.0)


class Rises(clarke_gym.Task):
    """No goal: the further to +x the better."""

    numbers = 1

    def begin(self, numbers):
        return np.zeros((len(numbers), self.robot.n_segments, 2)), numbers

    def evaluate(self, state, goal):
        x = state.tip_position[:, 0]
        return clarke_gym.Outcome(x / self.robot.length_m, x > 0.1)


def make_own(task):
    name = f"control_{task.__name__.lower()}"
    clarke_gym.register_task(name)(task)
    return gym.make("clarke_gym/Task-v0", task=name, representation="clarke")


@pytest.mark.usefixtures("registries")
@pytest.mark.parametrize("name", ["clarke_controller", "clarke_pid", "resolved_rate"])
def test_a_position_needs_no_prediction_of_its_own(name):
    env = make_own(Circle)
    controller, (observation, _) = make_controller(name, env), env.reset(seed=0)
    for _ in range(40):
        observation, *_, info = env.step(controller.act(observation))
    assert info["tip_error_m"] < 3e-3


@pytest.mark.usefixtures("registries")
def test_what_no_controller_can_plan_is_refused_when_it_is_made():
    env = make_own(Slope)
    with pytest.raises(ValueError, match="Slope has no `predicted`"):
        make_controller("clarke_controller", env)


@pytest.mark.usefixtures("registries")
def test_mppi_needs_no_goal_but_an_environment_without_wrapped_actions():
    env = make_own(Rises)
    controller = MppiController(env, MppiSettings(samples=32))
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        observation, reward, *_ = env.step(controller.act(observation))
    assert reward > 0.4
    with pytest.raises(ValueError, match="instead of a wrapper around its actions"):
        MppiController(ClarkeAction(gym.make("clarke_gym/Reach-v0")))


@pytest.mark.parametrize(
    ("settings", "wrong"),
    [
        (MppiSettings, {"samples": 0}),
        (MppiSettings, {"horizon": 0}),
        (MppiSettings, {"hold": 0}),
        (MppiSettings, {"temperature": 0.0}),
        (MppiSettings, {"noise": np.nan}),
        (MppiSettings, {"last": -1.0}),
        (Gains, {"proportional": np.nan}),
        (Gains, {"tip_memory_s": -1.0}),
        (Gains, {"speed_share": 0.0}),
        (Gains, {"speed_share": 1.5}),
    ],
)
def test_impossible_settings_are_refused(settings, wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        settings(**wrong)


@pytest.mark.parametrize("control_dt", [0.5, 0.7])
def test_long_control_periods_do_not_make_the_loops_swing(control_dt):
    env = gym.make("clarke_gym/Reach-v0", representation="clarke", control_dt=control_dt)
    controller, (observation, _) = make_controller("clarke_controller", env), env.reset(seed=1)
    for _ in range(40):
        observation, *_, info = env.step(controller.act(observation))
    assert info["tip_error_m"] < 1e-4
