"""The marginal likelihood against integrals, and PPO's own where nothing is marginal."""

import gymnasium as gym
import numpy as np
import pytest
import torch
from scipy import stats
from torch.distributions import Normal

from agents.learning.algorithms import PPOSettings
from agents.learning.config import EnvSettings, EvalSettings, TrainConfig
from agents.learning.manifold_policy import ManifoldGaussian, matched_gain
from agents.learning.models import make_model, make_training_env, onto_manifold
from agents.learning.policies import PolicyAgent, load_policy
from agents.learning.training import train
from clarke_gym.representations import make_representation
from clarke_gym.robots.presets import make_robot


def onto(name, n=3, segments=1):
    robot = make_robot(n_tendons=n, n_segments=segments)
    return robot.encoder @ make_representation(name, robot).decoder


def law(matrix, mean, log_std, **settings):
    distribution = ManifoldGaussian(matrix, **settings)
    return distribution.proba_distribution(
        torch.tensor(mean, dtype=torch.float32), torch.tensor(log_std, dtype=torch.float32)
    )


def test_likelihood_is_the_joint_one_integrated_over_what_does_not_matter():
    matrix = onto("raw", 3)
    mean, log_std = np.array([0.3, -0.2, 0.1]), np.array([-0.2, 0.1, -0.5])
    away = np.linalg.svd(matrix)[2][2]  # the direction that moves nothing
    action = np.array([0.5, 0.4, -0.7])
    t = np.linspace(-12, 12, 20_001)
    line = action + t[:, None] * away
    joint = Normal(torch.tensor(mean), torch.tensor(np.exp(log_std))).log_prob(torch.tensor(line))
    integral = np.trapezoid(joint.sum(dim=1).exp().numpy(), t)
    # u = M a squeezes areas across `away` by sqrt(det(M M^T)).
    expected = np.log(integral / np.sqrt(np.linalg.det(matrix @ matrix.T)))
    found = law(matrix, mean[None], log_std, likelihood="marginal").log_prob(
        torch.tensor(action[None], dtype=torch.float32)
    )
    assert float(found) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize("name", ["raw", "raw_scaled", "modal", "clarke_nuisance", "projected"])
@pytest.mark.parametrize("segments", [1, 2])
def test_likelihood_and_entropy_are_those_of_the_gaussian_on_the_manifold(name, segments):
    rng = np.random.default_rng(1)
    matrix = onto(name, 5, segments)
    mean, actions = rng.normal(size=(2, 7, matrix.shape[1]))
    log_std = rng.normal(scale=0.3, size=matrix.shape[1])
    found = law(matrix, mean, log_std, likelihood="marginal")
    covariance = matrix @ np.diag(np.exp(2 * log_std)) @ matrix.T
    for i in range(7):
        exact = stats.multivariate_normal(matrix @ mean[i], covariance)
        np.testing.assert_allclose(
            found.log_prob(torch.tensor(actions, dtype=torch.float32))[i],
            exact.logpdf(matrix @ actions[i]),
            rtol=1e-4,
            atol=1e-4,
        )
        assert float(found.entropy()[i]) == pytest.approx(exact.entropy(), abs=1e-4)


def test_the_marginals_gradient_is_the_joint_ones_expected_given_what_moves():
    matrix = torch.tensor(onto("raw", 5), dtype=torch.float32)
    mean = torch.zeros(400_000, 5, requires_grad=True)
    torch.manual_seed(0)
    actions = torch.randn(400_000, 5)
    reward = (actions @ matrix.T)[:, 0] ** 3  # anything that knows u alone
    gradients, spreads = [], []
    for likelihood in ("joint", "marginal"):
        found = law(matrix.numpy(), np.zeros((1, 5)), np.zeros(5), likelihood=likelihood)
        found.proba_distribution(mean, torch.zeros(5))
        (gradient,) = torch.autograd.grad((reward * found.log_prob(actions)).sum(), mean)
        gradients.append(gradient.mean(dim=0).numpy())
        spreads.append(float(gradient.var(dim=0).sum()))
    np.testing.assert_allclose(gradients[1], gradients[0], atol=0.005)
    assert spreads[1] < 0.8 * spreads[0]


def test_an_invertible_map_changes_the_likelihood_by_a_constant_that_is_left_out():
    matrix = np.array([[2.0, 0.3], [0.1, 0.5]])
    actions = torch.randn(9, 2, generator=torch.Generator().manual_seed(0))
    mean, log_std = np.full((9, 2), 0.2), np.array([0.1, -0.3])
    found = law(matrix, mean, log_std, likelihood="marginal").log_prob(actions)
    exact = stats.multivariate_normal(
        matrix @ mean[0], matrix @ np.diag(np.exp(2 * log_std)) @ matrix.T
    ).logpdf(actions.numpy() @ matrix.T)
    constant = np.log(abs(np.linalg.det(matrix)))
    np.testing.assert_allclose(found.numpy() - constant, exact, atol=1e-4)


def test_noise_on_the_manifold_leaves_it_nowhere_and_has_the_size_that_is_asked_for():
    matrix = onto("raw", 7)
    settings = {"likelihood": "marginal", "noise": "manifold"}
    found = law(matrix, np.zeros((200_000, 7)), np.log([0.5, 0.2]), **settings)
    torch.manual_seed(0)
    actions = found.sample().double().numpy()
    lift = np.linalg.pinv(matrix) @ matrix
    np.testing.assert_allclose(actions, actions @ lift.T, atol=1e-6)
    np.testing.assert_allclose((actions @ matrix.T).std(axis=0), [0.5, 0.2], rtol=0.01)
    assert float(found.entropy()[0]) == pytest.approx(
        stats.multivariate_normal(cov=np.diag([0.25, 0.04])).entropy(), abs=1e-5
    )


def config(**changes):
    kwargs = {"n_tendons": 5, "representation": changes.pop("representation", "clarke")}
    return TrainConfig(
        env=EnvSettings(num_envs=8, kwargs=kwargs),
        algo=PPOSettings(n_steps=32, batch_size=128, n_epochs=2, **changes),
        total_steps=1024,
        evaluation=EvalSettings(every_steps=256, n_goals=50),
        checkpoint_every_steps=512,
    )


def test_on_clarke_coordinates_it_is_ppo_bit_for_bit(tmp_path):
    changed = {"likelihood": "marginal", "mean_gain": "matched"}
    for name, settings in (("plain", {}), ("marginal", changed)):
        train(config(**settings), tmp_path / name)
    for file in ("evals.npz", "policy/policy.safetensors", "diagnostics.npz"):
        assert (tmp_path / "plain" / file).read_bytes() == (
            tmp_path / "marginal" / file
        ).read_bytes(), file


@pytest.mark.parametrize(
    "settings",
    [
        {"likelihood": "marginal"},
        {"likelihood": "marginal", "noise": "manifold"},
        {"mean_gain": 0.5},
    ],
)
def test_every_setting_learns_something_and_can_be_loaded_again(settings, tmp_path):
    run = config(representation="raw", **settings)
    train(run, tmp_path / "run")
    model = load_policy(tmp_path / "run", run)
    assert type(model.policy).__name__ == "ManifoldPolicy"
    fresh = make_model(run, make_training_env(run))
    assert not torch.equal(model.policy.log_std, fresh.policy.log_std)


@pytest.mark.parametrize("gain", [1.0, 0.5, "matched"])
def test_evaluation_and_numpy_know_the_gain_of_a_policy(gain, tmp_path):
    from clarke_gym.control import load_policy as load_numpy

    run = config(representation="raw", mean_gain=gain)
    train(run, tmp_path / "run")
    model = load_policy(tmp_path / "run", run)
    policy = load_numpy(tmp_path / "run" / "policy")
    seen = np.random.default_rng(0).uniform(-1, 1, (9, *model.observation_space.shape))
    seen = seen.astype(np.float32)
    actions, _ = model.predict(seen, deterministic=True)
    np.testing.assert_array_equal(PolicyAgent(model).act(seen), actions)
    np.testing.assert_allclose(policy.act(seen), actions, atol=1e-5)


def test_a_policy_of_goals_takes_the_dictionary_that_its_environment_gives(tmp_path):
    from clarke_gym.control import load_policy as load_numpy

    kwargs = {"n_tendons": 5, "representation": "clarke", "goal_env": True}
    run = config().model_copy(update={"env": EnvSettings(num_envs=8, kwargs=kwargs)})
    train(run, tmp_path / "run")
    env = gym.make("clarke_gym/Reach-v0", **kwargs)
    observation, _ = env.reset(seed=0)
    model, policy = load_policy(tmp_path / "run", run), load_numpy(tmp_path / "run" / "policy")
    action, _ = model.predict(observation, deterministic=True)
    np.testing.assert_allclose(policy.act(observation), action, atol=1e-5)


def test_the_gain_multiplies_the_mean_and_nothing_else():
    runs = [config(representation="raw", mean_gain=gain) for gain in (2.0, 4.0)]
    models = [make_model(run, make_training_env(run)) for run in runs]
    observation = np.random.default_rng(0).normal(size=(3, *models[0].observation_space.shape))
    tensor = torch.tensor(observation, dtype=torch.float32)
    small, large = (model.policy.get_distribution(tensor) for model in models)
    torch.testing.assert_close(2.0 * small.mode(), large.mode())
    torch.testing.assert_close(small.distribution.stddev, large.distribution.stddev)


def test_onto_is_the_map_from_actions_to_clarke_coordinates():
    run = config(representation="raw_scaled")
    robot = make_robot(n_tendons=5)
    np.testing.assert_allclose(
        onto_manifold(make_training_env(run)), np.sqrt(2.5) * robot.encoder, atol=1e-14
    )


def test_what_makes_no_sense_is_said():
    with pytest.raises(ValueError, match="noise=manifold has no joint likelihood"):
        config(noise="manifold")
    with pytest.raises(ValueError, match="likelihood need linear actions, not arc_polar"):
        config(representation="arc_polar", likelihood="marginal")
    with pytest.raises(ValueError, match="independent rows"):
        ManifoldGaussian([[1.0, 0.0], [2.0, 0.0]])


def test_files_of_runs_without_these_settings_do_not_name_them():
    assert PPOSettings().model_dump().keys().isdisjoint({"mean_gain", "likelihood", "noise"})


@pytest.mark.parametrize("n", [3, 11, 64])
def test_a_step_of_adam_moves_the_matched_mean_on_the_manifold_as_in_clarke(n):
    assert matched_gain(onto("clarke", n)) == 1.0
    assert matched_gain(onto("raw_scaled", n)) == pytest.approx(np.pi / np.sqrt(8 * n), rel=0.06)
    matrix = torch.tensor(onto("raw_scaled", n), dtype=torch.float32)
    weights = torch.zeros(n, requires_grad=True)
    optimizer = torch.optim.Adam([weights], lr=0.01)
    (-(matrix[0] @ weights)).backward()  # push one Clarke coordinate
    optimizer.step()
    moved = matched_gain(matrix) * float(matrix[0] @ weights.detach())
    assert moved == pytest.approx(0.01, rel=0.15)
