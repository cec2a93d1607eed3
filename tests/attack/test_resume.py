"""Kills at random instants and at every write; damage to every file; results stay byte-equal."""

import os
import random
import shutil
import signal
import time

import numpy as np
import pytest

from agents.learning import checkpoint, training
from agents.learning.algorithms import ALGORITHMS
from agents.learning.config import TrainConfig
from agents.learning.training import train
from tests.attack.world import DISTURBED, LONG, ON_MUJOCO, RUNS, disturbed, popen, write

NAMES = [name for name in RUNS if ALGORITHMS[RUNS[name]["algo"]["name"]].installed]


class Killed(BaseException):
    pass


def config(name):
    return TrainConfig.model_validate((RUNS | DISTURBED)[name])


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the results of an unbroken run, made once."""
    made = {}

    def result(name):
        if name not in made:
            folder = tmp_path_factory.mktemp(name)
            train(config(name), folder)
            made[name] = folder
        return made[name]

    return result


def equal(one, other):
    for name in ("evals.npz", "policy/policy.safetensors", "diagnostics.npz"):
        if (one / name).read_bytes() != (other / name).read_bytes():
            return False
    return True


def stop_after(steps):
    done = 0

    def hook(more):
        nonlocal done
        done += more
        if done > steps:
            raise Killed

    return hook


def test_runs_of_the_long_form_can_run():
    """The short form, which continuous integration runs, leaves some out."""
    for run in (RUNS | DISTURBED | ON_MUJOCO).values():
        for each in (run, disturbed(run)):
            TrainConfig.model_validate(each)


@pytest.mark.parametrize("name", [*NAMES, *DISTURBED])
def test_a_run_killed_between_rollouts_continues_to_the_byte(tmp_path, whole, name, figure):
    expected = whole(name)
    for kills, steps in enumerate((130, 300, 500)):
        with pytest.raises(Killed):
            train(config(name), tmp_path, stop_after(steps))
        assert len(list((tmp_path / "checkpoint").iterdir())) == min(kills + 1, 2)
    train(config(name), tmp_path)
    assert equal(tmp_path, expected)
    figure(f"{name}: stopped between rollouts 3 times, byte-equal")


AT_EVENTS = ["ppo", "sac_her", "ppo_short_mujoco"]


@pytest.mark.parametrize(
    "name", [*AT_EVENTS, "td3", "sac_her_mujoco", "td3_mujoco"] if LONG else AT_EVENTS
)
def test_a_run_killed_at_every_event_of_the_file_system(tmp_path, name, monkeypatch, figure):
    """Each fsync, rename, mkdir and unlink of a run is the last one in turn."""
    short = TrainConfig.model_validate((RUNS | ON_MUJOCO)[name] | {"total_steps": 256})
    expected = tmp_path / "whole"
    train(short, expected)  # the first in a process may do more than the later ones
    count, last = 0, None

    def dying(function):
        def call(*args, **kwargs):
            nonlocal count
            count += 1
            if count == last:
                os._exit(9)
            return function(*args, **kwargs)

        return call

    for name_ in ("fsync", "replace", "mkdir", "rename", "unlink"):
        monkeypatch.setattr(os, name_, dying(getattr(os, name_)))
    train(short, tmp_path / "counted")
    events = count
    few = range(5, events, events // (8 if name == "ppo" else 3))
    points = range(1, events + 1) if LONG else [1, *few, events]
    for point in points:
        folder = tmp_path / f"at_{point}"
        child = os.fork()
        if child == 0:
            count, last = 0, point
            train(short, folder)
            os._exit(0)
        _, status = os.waitpid(child, 0)
        assert os.waitstatus_to_exitcode(status) == 9, point
        train(short, folder)
        assert equal(folder, expected), point
        left = list(folder.rglob(".part-*"))
        assert not left, (point, left)
    figure(f"{name}: killed at {len(points)} of {events} events, all byte-equal, nothing left")


OFTEN = [name for name in (*RUNS, *ON_MUJOCO) if name not in ("ppo_mujoco", "tqc")]


@pytest.mark.parametrize("name", OFTEN if LONG else ["ppo", "td3_her_mujoco"])
def test_a_run_killed_at_random_instants_continues_to_the_byte(tmp_path, name, figure):
    """SIGKILL at instants spread over the run, disturbances on."""
    run = TrainConfig.model_validate(disturbed((RUNS | ON_MUJOCO)[name]))
    began = time.monotonic()
    train(run, tmp_path / "whole")
    took = time.monotonic() - began
    chance = random.Random(name)
    kills = runs = 0
    while kills < (20 if LONG else 4):
        child = os.fork()
        if child == 0:
            train(run, tmp_path / f"run_{runs}")
            os._exit(0)
        time.sleep(chance.uniform(0.0, 0.5 * took))
        os.kill(child, signal.SIGKILL)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        assert code in (0, -signal.SIGKILL)
        kills += code != 0
        runs += code == 0  # it was done before: another run is next
    for folder in (tmp_path / f"run_{i}" for i in range(runs + 1)):
        train(run, folder)
        assert equal(folder, tmp_path / "whole"), folder
    figure(f"{name}: {kills} kills at random instants in {runs + 1} runs, byte-equal")


def test_the_command_killed_at_random_instants(tmp_path):
    longer = RUNS["ppo"] | {"total_steps": 8192 if LONG else 4096}
    train(TrainConfig.model_validate(longer), tmp_path / "whole")
    path = write(tmp_path / "run.yaml", longer)
    command = ("train", "--config", path, "--out", tmp_path / "run")
    chance = random.Random(0)
    for _ in range(10 if LONG else 2):
        with popen(*command) as process:
            time.sleep(chance.uniform(1.5, 4.0))
            process.kill()
    with popen(*command) as process:
        output = process.communicate(timeout=300)
    assert process.returncode == 0, output
    assert equal(tmp_path / "run", tmp_path / "whole")


@pytest.mark.parametrize("name", ["ppo", "sac_her", "td3"])
def test_every_flipped_bit_of_a_checkpoint_is_seen(tmp_path, whole, name, capsys, figure):
    """Flips anywhere in any file: said, and the checkpoint before it continues."""
    with pytest.raises(Killed):
        train(config(name), tmp_path / "run", stop_after(300))
    newest = max((tmp_path / "run" / "checkpoint").iterdir())
    chance = random.Random(1)
    names = sorted(path.name for path in newest.iterdir())
    flips = 68 if LONG else 24
    for i in range(flips):
        path = newest / names[i % len(names)]
        data = path.read_bytes()
        bit = chance.randrange(8 * len(data))
        damaged = bytearray(data)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        with pytest.raises(checkpoint.DamagedError):
            checkpoint._read(newest)
        path.write_bytes(data)
    path.write_bytes(damaged)
    train(config(name), tmp_path / "run")
    assert "is damaged" in capsys.readouterr().err
    assert equal(tmp_path / "run", whole(name))
    figure(f"{name}: {flips} flipped bits, {flips} seen")


@pytest.mark.parametrize(
    "name", ["state.json", "arrays.npz", "tensors.safetensors", "manifest.json"]
)
def test_a_cut_or_missing_file_of_both_checkpoints_starts_again(tmp_path, whole, name, capsys):
    with pytest.raises(Killed):
        train(config("ppo"), tmp_path, stop_after(300))
    first, second = sorted((tmp_path / "checkpoint").iterdir())
    (first / name).unlink()
    os.truncate(second / name, (second / name).stat().st_size // 2)
    train(config("ppo"), tmp_path)
    assert capsys.readouterr().err.count("is damaged") == 2
    assert equal(tmp_path, whole("ppo"))


@pytest.mark.parametrize("name", NAMES)
def test_a_finished_run_is_extended_exactly_and_the_old_result_kept(tmp_path, whole, name):
    short = TrainConfig.model_validate(RUNS[name] | {"total_steps": 256})
    train(short, tmp_path)
    before = {p: (tmp_path / p).read_bytes() for p in (*training.RESULTS, "manifest.json", "DONE")}
    assert train(config(name), tmp_path)
    assert equal(tmp_path, whole(name))
    kept = tmp_path / "until_000000000256"
    assert {p: (kept / p).read_bytes() for p in before} == before
    assert not train(config(name), tmp_path)


def test_a_run_of_a_study_is_not_extended(tmp_path):
    folder = tmp_path / "study" / "arm" / "seed_00"
    short = TrainConfig.model_validate(RUNS["ppo"] | {"total_steps": 256})
    train(short, folder)
    (tmp_path / "study" / "study.yaml").touch()
    with pytest.raises(ValueError, match="belongs to a study"):
        train(config("ppo"), folder)
    assert (folder / "DONE").exists()


def test_a_run_whose_learning_rate_fell_is_not_extended(tmp_path):
    train(TrainConfig.model_validate(DISTURBED["ppo_slowing"] | {"total_steps": 256}), tmp_path)
    with pytest.raises(ValueError, match="final_learning_rate, from which a longer run"):
        train(config("ppo_slowing"), tmp_path)
    assert (tmp_path / "DONE").exists()


def test_checkpoints_keep_every_kind_of_state():
    from collections import deque

    from agents.learning.encoding import decode_state, encode_state

    generator = np.random.Generator(np.random.MT19937(3))
    state = {
        "a": [1, 2.5, None, True, "x", float("inf")],
        "t": (np.float32(0.1), np.arange(3), deque([1], maxlen=4)),
        3: {"generator": generator, "philox": np.random.Generator(np.random.Philox(1))},
    }
    back = decode_state(encode_state(state))
    assert back["a"] == state["a"]
    assert back["t"][0] == np.float32(0.1)
    assert back["t"][0].dtype == np.float32
    assert back["t"][2].maxlen == 4
    assert back[3]["generator"].random() == generator.random()
    assert back[3]["philox"].random() == state[3]["philox"].random()
    with pytest.raises(TypeError, match=r"state\.o: a object cannot"):
        encode_state({"o": object()})


def test_arrays_with_a_number_for_each_environment_are_kept_whole():
    """Where the buffer has as many rows as there are environments, too."""
    envs = RUNS["sac_her"]["env"] | {"num_envs": 128}
    algo = RUNS["sac_her"]["algo"] | {"buffer_size": 128 * 128, "updates_per_env_step": 1.0}
    changes = {"env": envs, "algo": algo, "total_steps": 1024, "checkpoint_every_steps": 1024}
    changes |= {"evaluation": {"every_steps": 1024, "n_goals": 50}}
    model, vec_env = training._make(TrainConfig.model_validate(RUNS["sac_her"] | changes))
    model.replay_buffer.pos = 5
    kept = checkpoint._replay(model)["arrays"]
    assert kept["_current_ep_start."].shape == (128,)
    assert kept["actions."].shape[:2] == (5, 128)
    vec_env.close()


def test_a_copied_checkpoint_of_another_model_is_refused(tmp_path, whole, capsys):
    with pytest.raises(Killed):
        train(config("ppo"), tmp_path / "run", stop_after(300))
    newest = max((tmp_path / "run" / "checkpoint").iterdir())
    shutil.rmtree(newest)
    shutil.copytree(whole("sac") / "checkpoint" / newest.name.replace("256", "512"), newest)
    train(config("ppo"), tmp_path / "run")
    assert "it is of another model" in capsys.readouterr().err
    assert equal(tmp_path / "run", whole("ppo"))
