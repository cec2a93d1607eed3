"""Gymnasium's own vector wrappers on the native vector environment, in all three reset modes."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.wrappers import vector

import clarke_gym  # noqa: F401

MODES = ("next_step", "same_step", "disabled")


def played(mode, wrap, steps=120):
    """Yield what each step of wrapped environments returns; episodes last 20 steps."""
    envs = wrap(
        gym.make_vec(
            "clarke_gym/Reach-v0",
            num_envs=3,
            n_tendons=5,
            representation="clarke",
            episode_steps=20,
            autoreset_mode=mode,
        )
    )
    envs.reset(seed=1)
    envs.action_space.seed(1)
    for _ in range(steps):
        step = envs.step(envs.action_space.sample())
        yield step
        ended = step[2] | step[3]
        if mode == "disabled" and ended.any():
            envs.reset(options={"reset_mask": ended})
    envs.close()


@pytest.mark.parametrize("mode", MODES)
def test_statistics_of_episodes_are_recorded(mode):
    lengths, returns = [], []
    for *_, infos in played(mode, vector.RecordEpisodeStatistics):
        if "episode" in infos:
            done = infos["_episode"]
            lengths += infos["episode"]["l"][done].tolist()
            returns += infos["episode"]["r"][done].tolist()
    assert len(lengths) >= 3 * 5
    assert set(lengths) == {20}
    assert 0.0 < min(returns) <= max(returns) <= 20.0


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "wrap",
    [
        lambda envs: vector.RescaleAction(envs, np.float32(-0.5), np.float32(0.5)),
        lambda envs: vector.ClipReward(envs, 0.0, 0.5),
        lambda envs: vector.NormalizeReward(envs, gamma=0.95),
        lambda envs: vector.DictInfoToList(envs),
    ],
    ids=["rescale", "clip", "normalise_reward", "dict_info"],
)
def test_wrappers_work_unchanged(mode, wrap):
    for observation, reward, *_ in played(mode, wrap, steps=45):
        assert observation.shape == (3, 13)
        assert np.isfinite(observation).all()
        assert np.isfinite(reward).all()


@pytest.mark.parametrize("mode", MODES)
def test_wrappers_of_observations_take_the_modes_that_gymnasium_lets_them(mode):
    if mode == "same_step":  # Gymnasium itself refuses: infos hold observations, too
        with pytest.raises(ValueError, match="NEXT_STEP or DISABLED"):
            next(played(mode, vector.FlattenObservation))
        return
    for observation, *_ in played(mode, vector.FlattenObservation, steps=45):
        assert observation.shape == (3, 13)
