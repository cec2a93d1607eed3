"""What must hold for every registered id x representation x physics."""

import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as sb3_check_env

from clarke_gym.registration import ENVIRONMENTS
from clarke_gym.representations import representation_names
from clarke_gym.representations.instruments import INSTRUMENTS

IDS = [name for name, keywords in sorted(ENVIRONMENTS.items()) if keywords]
"""Ids with a task of their own; "clarke_gym/Task-v0" takes any by name."""
REPRESENTATIONS = [name for name in representation_names() if name not in INSTRUMENTS]
"""Instruments are for actions alone: some of their numbers say nothing."""
PHYSICS = ["constant_curvature", "mujoco"]


REACH = "clarke_gym/Reach-v0"


def physics_of(env_id):
    """The models that an environment can have; a scene with forces needs MuJoCo."""
    return [ENVIRONMENTS[env_id]["physics"]] if "physics" in ENVIRONMENTS[env_id] else PHYSICS


def has_goal(env_id):
    return gym.make(env_id).unwrapped.task.goal is not None


GRID = [
    (REACH, physics, representation, n, segments, {"goal_env": goal_env})
    for physics in PHYSICS
    for representation in REPRESENTATIONS
    for n in ((3, 8, 32) if representation in ("raw", "clarke") else (4,))
    for segments in (1, 2, 3)
    for goal_env in (False, True)
] + [
    (env_id, physics, representation, n, 1 + n % 2, keywords)
    for env_id in IDS
    if env_id != REACH
    for physics in physics_of(env_id)
    for representation in ("raw", "clarke")
    for n in (3, 8)
    for keywords in ({}, {"reward": "sparse"}, {"goal_env": True}, {"disturbances": "harsh"})
    if has_goal(env_id) or "goal_env" not in keywords
]
SMALL = [
    pytest.param(env_id, representation, physics, id=f"{env_id}-{representation}-{physics}")
    for env_id in IDS
    for representation in (REPRESENTATIONS if env_id == REACH else ("raw", "clarke"))
    for physics in physics_of(env_id)
]


def make(env_id, representation, physics, **kwargs):
    kwargs.setdefault("n_tendons", 4)
    return gym.make(env_id, representation=representation, physics=physics, **kwargs)


@pytest.mark.parametrize(
    ("env_id", "physics", "representation", "n", "segments", "keywords"), GRID, ids=str
)
def test_both_checkers_pass_without_a_warning(
    env_id, physics, representation, n, segments, keywords
):
    keywords = {
        "physics": physics,
        "representation": representation,
        "n_tendons": n,
        "n_segments": segments,
        **keywords,
    }
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(env_id, **keywords), skip_render_check=True)
        sb3_check_env(gym.make(env_id, **keywords))


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
def test_equal_seeds_and_actions_give_equal_bits(env_id, representation, physics):
    runs = []
    for _ in range(2):
        env = make(env_id, representation, physics, n_segments=2)
        env.action_space.seed(3)
        trace = [env.reset(seed=7)[0]]
        for _ in range(60):
            observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
            trace += [observation, reward]
            if terminated or truncated:
                trace.append(env.reset()[0])
        runs.append(trace)
    for a, b in zip(*runs, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
def test_spec_survives_json(env_id, representation, physics):
    goal_env = has_goal(env_id)
    env = make(env_id, representation, physics, n_segments=2, control="absolute", goal_env=goal_env)
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    assert again.spec == env.spec
    assert str(again) == str(env)
    assert again.observation_space == env.observation_space
    assert again.action_space == env.action_space
    first, second = env.reset(seed=1)[0], again.reset(seed=1)[0]
    if goal_env:
        first, second = first["observation"], second["observation"]
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
def test_observations_stay_in_their_space_and_use_it(env_id, representation, physics):
    num_envs, steps = (4, 60) if physics == "mujoco" else (64, 120)  # slack tendons are slow
    envs = gym.make_vec(
        env_id, num_envs=num_envs, representation=representation, physics=physics, n_tendons=4
    )
    rng = np.random.default_rng(0)
    observations = [envs.reset(seed=0)[0]]
    for k in range(steps):
        # Long one-sided pushes reach the limits; random ones the inside.
        if k % 40 == 0:
            push = np.sign(rng.uniform(-1, 1, envs.action_space.shape))
        actions = push if k % 3 else rng.uniform(-1, 1, envs.action_space.shape)
        observations.append(envs.step(actions.astype(np.float32))[0])
        assert envs.observation_space.contains(observations[-1])
    spread = np.ptp(np.concatenate(observations), axis=0)
    if physics == "mujoco" and representation == "clarke_common":
        spread = np.delete(spread, 5)  # parallel tendons cannot show a common displacement
    assert (spread > 0.01).all()  # no constant element


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
def test_arrays_are_new_in_every_call(env_id, representation, physics):
    env = make(env_id, representation, physics)
    first, info_1 = env.reset(seed=0)
    kept = first.copy()
    second, _, _, _, info_2 = env.step(env.action_space.sample())
    third, _, _, _, info_3 = env.step(env.action_space.sample())
    np.testing.assert_array_equal(first, kept)
    assert not np.shares_memory(second, third)
    assert info_1 is not info_2
    assert info_2 is not info_3


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
def test_environments_pickle(env_id, representation, physics):
    env = make(env_id, representation, physics)
    env.reset(seed=0)
    twin = pickle.loads(pickle.dumps(env))
    action = env.action_space.sample()
    np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])


@pytest.mark.parametrize(("env_id", "representation", "physics"), SMALL)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_actions_that_are_not_finite_are_refused(env_id, representation, physics, bad):
    env = make(env_id, representation, physics, disable_env_checker=True)
    env.reset(seed=0)
    action = np.zeros(env.action_space.shape, np.float32)
    action[-1] = bad
    with pytest.raises(ValueError, match="action must be finite"):
        env.step(action)


@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"n_tendons": 2}, "n_tendons must be at least 3, got 2"),
        ({"physics": "sofa"}, r"physics must be one of \['constant_curvature', 'mujoco'\]"),
        ({"control": "velocity"}, r"control must be one of \['increment', 'absolute'\]"),
        ({"control_dt": 0.0}, "control_dt must be a positive finite number, got 0.0"),
        ({"control_dt": float("nan")}, "control_dt"),
        ({"reward": "shaped"}, r"reward must be one of \['dense', 'sparse'\], got 'shaped'"),
        ({"success_tolerance": -1.0}, "success_tolerance"),
        ({"representation": "polar"}, "representation must be one of"),
        ({"robot": "octopus"}, "robot must be one of"),
        ({"render_mode": "ascii"}, "render_mode"),
    ],
)
def test_bad_keywords_are_named(env_id, keywords, message):
    with pytest.raises(ValueError, match=message):
        gym.make(env_id, **keywords)


@pytest.mark.parametrize("env_id", IDS)
def test_unknown_keywords_are_named_with_the_id(env_id):
    with pytest.raises(TypeError, match="n_tendon"):
        gym.make(env_id, n_tendon=3)
