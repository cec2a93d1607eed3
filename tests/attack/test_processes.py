"""Workers that die, signals, two studies in one folder."""

import os
import random
import signal
import subprocess
import time

import pytest

from agents.learning.config import TrainConfig
from agents.learning.training import train
from agents.studies import executors
from agents.studies.config import StudyConfig
from agents.studies.study import run_study
from agents.yaml_files import yaml_text
from tests.attack.world import (
    LONG,
    LONGER,
    ON_MUJOCO,
    RUNS,
    STUDY,
    has_checkpoint,
    popen,
    tree,
    wait_for,
    write,
)

LONG_STUDY = STUDY | {"base": STUDY["base"] | LONGER}


def children(pid):
    """Return the processes that train for a study."""
    found = []
    for path in os.listdir("/proc"):
        try:
            with open(f"/proc/{path}/stat") as file:
                parent = int(file.read().rpartition(")")[2].split()[1])
            with open(f"/proc/{path}/cmdline") as file:
                command = file.read()
        except (OSError, ValueError):
            continue
        if parent == pid and "spawn_main" in command:
            found.append(int(path))
    return found


def test_a_killed_worker_costs_its_own_run_the_last_minutes_only(tmp_path, figure):
    path = write(tmp_path / "study.yaml", LONG_STUDY)
    out = tmp_path / "out"
    with popen("study", "--config", path, "--out", out, "--workers", 2) as process:
        wait_for(lambda: len(list(out.glob("*/*/checkpoint/step_*"))) >= 2)
        os.kill(children(process.pid)[0], signal.SIGKILL)
        output = process.stdout.read() + process.stderr.read()
    assert process.returncode == 0, output
    assert "was killed by SIGKILL; continuing it (1 of 3 times)" in output
    for run in StudyConfig.model_validate(LONG_STUDY).runs():
        train(run, tmp_path / "alone" / run.name)
        expected = (tmp_path / "alone" / run.name / "evals.npz").read_bytes()
        assert (out / run.name / "seed_00" / "evals.npz").read_bytes() == expected
    figure("a killed worker: both runs complete, byte-equal")


BOTH_PHYSICS = STUDY | {
    "representations": [{"label": "raw"}],
    "tasks": [{"label": "rod", "env": ON_MUJOCO["sac_mujoco"]["env"]["kwargs"]}, {"label": "arc"}],
    "base": STUDY["base"] | LONGER | {"total_steps": 4_096},
}


def alone(study, folder):
    """Return the results of a study's runs, trained one after the other in this process."""
    results = {}
    for run in StudyConfig.model_validate(study).runs():
        train(run, folder / run.name)
        results[run.name] = (folder / run.name / "evals.npz").read_bytes()
    return results


@pytest.mark.skipif(not LONG, reason="the long form")
def test_a_study_killed_at_random_instants_continues_to_the_byte(tmp_path, figure):
    """SIGKILL of the study, of a worker, and of all of them, in turn."""
    path, out = write(tmp_path / "study.yaml", BOTH_PHYSICS), tmp_path / "out"
    command = ("study", "--config", path, "--out", out, "--workers", 2)
    chance = random.Random(4)
    for kill in range(12):
        with popen(*command, start_new_session=True) as process:
            wait_for(lambda process=process: children(process.pid) or process.poll() is not None)
            time.sleep(chance.uniform(0.0, 8.0))
            workers = children(process.pid)
            if kill % 3 == 0:
                process.kill()
            elif kill % 3 == 1 and workers:
                os.kill(chance.choice(workers), signal.SIGKILL)
                time.sleep(chance.uniform(0.0, 4.0))
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
        wait_for(lambda gone=workers: not [pid for pid in gone if os.path.exists(f"/proc/{pid}")])
    with popen(*command) as process:
        output = process.communicate(timeout=300)
    assert process.returncode == 0, output
    for name, expected in alone(BOTH_PHYSICS, tmp_path / "alone").items():
        assert (out / name / "seed_00" / "evals.npz").read_bytes() == expected
    figure("a study of both physics: 12 kills at random instants, byte-equal")


DYING = """
import os, pathlib, signal, sys

def patch():
    from agents import files
    state = [0, None]

    def dying(function):
        def call(*args, **kwargs):
            state[0] += 1
            if state[1] is not None and state[0] == state[1][0]:
                state[1][1].write_text("killed here")
                os.kill(os.getpid(), signal.SIGKILL)
            return function(*args, **kwargs)
        return call

    def locked(folder, locked=files.locked):
        mark = pathlib.Path(f"{folder}.killed")
        state[:] = [0, None if mark.exists() else (int(folder.name), mark)]
        return locked(folder)

    for name in ("fsync", "replace", "mkdir", "rename", "unlink"):
        setattr(os, name, dying(getattr(os, name)))
    files.locked = locked

if any("spawn_main" in word for word in sys.orig_argv):
    patch()
"""


def test_a_worker_killed_at_events_of_the_file_system(tmp_path, plug_in, figure):
    """Each run of a pool dies once, at another event; a new worker finishes it."""
    plug_in("dying", DYING)
    config = {"total_steps": 256, "plugins": ["dying"]}
    run = TrainConfig.model_validate(RUNS["ppo"] | config)
    train(run, tmp_path / "whole")
    points = range(1, 50, 4) if LONG else (2, 40)
    jobs = [(run, tmp_path / str(point)) for point in points]
    lines = []
    ends = list(executors.run_pool(jobs, 2, lambda _: None, lines.append))
    assert [end.outcome for end in ends] == ["done"] * len(points), ends
    assert len(lines) == len(list(tmp_path.glob("*.killed"))) == len(points)
    expected = (tmp_path / "whole" / "evals.npz").read_bytes()
    assert all((folder / "evals.npz").read_bytes() == expected for _, folder in jobs)
    figure(f"workers killed at {len(points)} events of the file system, byte-equal")


@pytest.fixture
def plug_in(tmp_path, monkeypatch):
    """Return a function that makes a plug-in which workers find too."""

    def make(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.chdir(tmp_path)
        monkeypatch.syspath_prepend(tmp_path)
        paths = f"{tmp_path}{os.pathsep}{os.environ.get('PYTHONPATH', '')}"
        monkeypatch.setenv("PYTHONPATH", paths)
        executors.allow_plugins([name])

    return make


def test_a_run_whose_process_always_dies_is_given_up_and_the_others_go_on(
    tmp_path, monkeypatch, plug_in
):
    plug_in(
        "deadly",
        "import os, sys\n"
        "if any('spawn_main' in word for word in sys.orig_argv): os.kill(os.getpid(), 9)\n",
    )
    deadly = TrainConfig.model_validate(RUNS["ppo"] | {"plugins": ["deadly"]})
    good = TrainConfig.model_validate(RUNS["ppo"])
    kills = iter(range(100))
    monkeypatch.setattr(executors, "memory_kills", lambda: next(kills))
    lines = []
    jobs = [(deadly, tmp_path / "bad"), (good, tmp_path / "good")]
    ends = {
        end.job[1].name: end for end in executors.run_pool(jobs, 1, lambda _: None, lines.append)
    }
    assert ends["good"].outcome == "done"
    assert ends["bad"].outcome == "unfinished"
    assert len(lines) == executors.MAX_DEATHS
    assert "for lack of memory" in ends["bad"].reason
    assert not (tmp_path / "bad" / "FAILED").exists()


STOPS = [("study", signal.SIGINT, 130), ("train", signal.SIGTERM, 143)]
if LONG:
    STOPS += [("train", signal.SIGINT, 130), ("study", signal.SIGTERM, 143)]


@pytest.mark.parametrize(("command", "number", "code"), STOPS)
def test_signals_stop_within_three_seconds_in_one_line(tmp_path, number, code, command, figure):
    config = (
        LONG_STUDY
        if command == "study"
        else RUNS["ppo"] | LONGER | {"total_steps": 10**6 // 1024 * 1024}
    )
    path = write(tmp_path / "config.yaml", config)
    out = tmp_path / "out"
    with popen(command, "--config", path, "--out", out, start_new_session=True) as process:
        wait_for(lambda: has_checkpoint(out))
        workers = children(process.pid)
        began = time.monotonic()
        if number == signal.SIGINT:  # a terminal sends it to all
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        error = process.stderr.read()
        process.wait(10)
        took = time.monotonic() - began
    assert process.returncode == code
    assert took < 3.0
    assert error.splitlines() == ["stopped; the same command continues from the last checkpoint"]
    assert not [pid for pid in workers if os.path.exists(f"/proc/{pid}")]
    assert not list(out.rglob("FAILED"))
    figure(f"{signal.Signals(number).name} in {command}: stopped after {took:.2f} s")
    if LONG and command == "study":
        with popen(command, "--config", path, "--out", out) as process:
            process.communicate()
        assert process.returncode == 0


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM] if LONG else [signal.SIGINT])
def test_a_library_that_does_not_close_holds_up_no_stop(tmp_path, number):
    (tmp_path / "stuck.py").write_text(
        "import time\n"
        "from stable_baselines3.common.logger import Logger\n"
        "Logger.close = lambda self: time.sleep(120)\n"
    )
    config = RUNS["ppo"] | LONGER | {"total_steps": 1_024_000, "plugins": ["stuck"]}
    path = write(tmp_path / "config.yaml", config)
    out = tmp_path / "out"
    command = ("train", "--config", path, "--out", out, "--plugins", "stuck")
    with popen(*command, cwd=tmp_path) as process:
        wait_for(lambda: has_checkpoint(out))
        process.send_signal(number)
        try:
            assert process.wait(30) == 128 + number  # far from 120
        finally:
            process.kill()


@pytest.fixture
def mounted():
    """Return a function that gives a folder a file system of its own, of a size."""
    folders = []

    def mount(folder, size):
        folder.mkdir(parents=True)
        command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
        try:
            done = subprocess.run(command, capture_output=True, check=False).returncode == 0
        except FileNotFoundError:
            done = False
        if not done:
            pytest.skip("mounting needs privileges")
        folders.append(folder)
        return folder

    yield mount
    for folder in folders:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def remount(folder, option):
    subprocess.run(["mount", "-o", f"remount,{option}", str(folder)], check=True)


def test_a_full_disk_of_one_run_lets_the_others_go_on(tmp_path, mounted, figure):
    small_disk = mounted(tmp_path / "out" / "raw_n3", "64k")
    study = StudyConfig.model_validate(STUDY)
    (tmp_path / "out" / "study.yaml").write_text(yaml_text(study.resolved()))
    path = write(tmp_path / "study.yaml", STUDY)
    command = ("study", "--config", path, "--out", tmp_path / "out", "--workers", 1)
    with popen(*command) as process:
        output = process.stdout.read() + process.stderr.read()
    assert process.returncode == 1
    assert f"no space left on the file system of {small_disk} for" in output
    assert "1 runs unfinished; the same command continues them" in output
    assert (tmp_path / "out" / "clarke_n3" / "seed_00" / "DONE").exists()
    assert not (small_disk / "seed_00" / "FAILED").exists()
    remount(small_disk, "size=64m")
    with popen(*command) as process:
        process.communicate()
    assert process.returncode == 0
    figure("a full disk: named, the other run complete, the run complete once there was room")


def test_a_read_only_folder_is_one_line_and_loses_nothing(tmp_path, mounted, figure):
    """Root ignores permission bits, so the file system itself is read-only."""
    disk = mounted(tmp_path / "disk", "64m")
    path = write(tmp_path / "run.yaml", RUNS["ppo"])
    study = write(tmp_path / "study.yaml", STUDY)
    run_study(StudyConfig.model_validate(STUDY), disk / "study", 1)
    config, done = TrainConfig.model_validate(RUNS["ppo"]), 0
    train(config, tmp_path / "whole")

    def stop(steps):
        nonlocal done
        done += steps
        if done > 300:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(config, disk / "run", stop)
    before = tree(disk)
    remount(disk, "ro")
    commands = [
        ("train", "--config", path, "--out", disk / "run"),
        ("train", "--config", path, "--out", disk / "new"),
        ("study", "--config", study, "--out", disk / "study"),
        ("study", "--config", study, "--out", disk / "new"),
        ("report", "--study", disk / "study"),
    ]
    for command in commands if LONG else commands[::2]:
        with popen(*command) as process:
            _, error = process.communicate()
        assert process.returncode == 2, (command, error)
        assert error.startswith("error: [Errno 30] Read-only file system: "), (command, error)
        assert error.count("\n") == 1
    assert tree(disk) == before
    remount(disk, "rw")
    assert train(config, disk / "run")
    assert (disk / "run" / "evals.npz").read_bytes() == (
        tmp_path / "whole" / "evals.npz"
    ).read_bytes()
    figure("a read-only file system: one line a command, nothing lost")


def test_a_fault_of_one_folder_lets_the_other_runs_go_on(tmp_path):
    study = StudyConfig.model_validate(STUDY)
    out = tmp_path / "out"
    out.mkdir()
    (out / "raw_n3").write_text("in the way")
    (out / "study.yaml").write_text(yaml_text(study.resolved()))
    ends = run_study(study, out, 1)
    assert ends == {"done": 1, "unfinished": 1}
    assert not list(out.rglob("FAILED"))
    (out / "raw_n3").unlink()
    assert run_study(study, out, 1) == {"done": 1}
    before = tree(out)
    assert run_study(study, out, 1) == {}
    assert tree(out) == before


def test_two_studies_in_one_folder_and_train_in_a_run_of_a_study(tmp_path):
    endless = STUDY | {"base": STUDY["base"] | LONGER | {"total_steps": 1024 * 1024}}
    path = write(tmp_path / "study.yaml", endless)
    out = tmp_path / "out"
    run = StudyConfig.model_validate(endless).runs()[0]
    single = write(tmp_path / "run.yaml", run.model_dump(mode="json"))
    folder = out / run.name / "seed_00"
    with popen("study", "--config", path, "--out", out, "--workers", 1) as first:
        wait_for(lambda: has_checkpoint(out))
        for command in (
            ("study", "--config", path, "--out", out),
            ("train", "--config", single, "--out", folder),
        ):
            with popen(*command) as second:
                error = second.stderr.read()
            assert second.returncode == 2
            assert "in use by another process" in error
            assert error.count("\n") == 1
        assert first.poll() is None
        first.terminate()
        first.communicate()
    assert not list(out.rglob("FAILED"))
