"""Where the runs of a study are carried out, on a cluster: one task of Ray for each.

Run folders lie on a file system that every machine sees, and the environment of the study's process
is there on every machine, as with Slurm. A run whose process or machine is lost goes to another one
and continues from its checkpoint, as in the pool.
"""

from __future__ import annotations

import importlib
import os
import signal
import socket
import sys
import time
from collections import Counter
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from agents import files
from agents.files import ROOT, ConfigError
from agents.plugins import allow_plugins, allowed_plugins
from agents.studies.executors import End, Job, Outcome, carry_out, given_up, one_line

ANSWER_S = 5.0
"""Seconds in which an address must answer."""

POLL_S = 0.5
"""Seconds between looks at what was done."""

LOST_S = 60.0
"""Seconds in which a process ends whose machine or study the cluster has lost."""


class _Board:
    """Environment steps that were done since somebody asked last."""

    def __init__(self) -> None:
        self._steps = 0

    def add(self, steps: int) -> None:
        self._steps += steps

    def take(self) -> int:
        steps, self._steps = self._steps, 0
        return steps


def _ray() -> Any:
    """Return the library, which checks of types see only where it is installed: so they do not."""
    try:
        importlib.import_module("ray.util.scheduling_strategies")
        return importlib.import_module("ray")
    except ImportError as error:
        raise ConfigError(f"--ray needs Ray: pip install --group cluster ({error})") from None


def connect(address: str) -> None:
    """Join a running cluster.

    Parameters
    ----------
    address : str
        ``host:port`` of its head, or "auto" for the one that this machine belongs to.

    Raises
    ------
    ConfigError
        If Ray is not installed, or no cluster answers.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")  # or it warns of the future
    ray = _ray()
    if address != "auto":
        host, _, port = address.rpartition(":")
        try:
            socket.create_connection((host, int(port)), ANSWER_S).close()
        except (OSError, ValueError, OverflowError) as error:
            raise ConfigError(
                f"--ray {address!r}: no cluster answers ({error}); give host:port of its head, or "
                "'auto' on one of its machines"
            ) from None
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    paths = [str(ROOT), *(path for path in sys.path if path)]
    environment = {"PYTHONPATH": os.pathsep.join(paths), "OMP_NUM_THREADS": "1"}
    try:
        ray.init(
            address=address,
            log_to_driver=False,
            logging_level="ERROR",
            runtime_env={"env_vars": environment},
        )
    except (ConnectionError, RuntimeError, ValueError) as error:
        raise ConfigError(f"--ray {address!r}: no cluster answers ({one_line(error)})") from None
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _train(job: Job, plugins: list[str], board: Any) -> tuple[Outcome, str]:
    """Carry out one run in a process of the cluster."""
    allow_plugins(plugins)
    end = time.monotonic() + LOST_S
    while time.monotonic() < end:
        try:
            with files.locked(job[1]):
                break
        except files.InUse:  # the process that was lost or stopped has not ended yet
            time.sleep(POLL_S)
    return carry_out(job, board.add.remote)


def run_cluster(
    jobs: list[Job],
    report: Callable[[int], object],
    say: Callable[[str], object] = print,
) -> Generator[End, None, None]:
    """Train all jobs on the cluster that `connect` has joined, one core each.

    Parameters
    ----------
    jobs : list of (TrainConfig, Path)
        Runs and their folders, which every machine sees at the same place.
    report : callable
        Called with environment steps as they are done.
    say : callable
        Called with a line when a process or machine was lost and its run goes on elsewhere.

    Yields
    ------
    End
        In order of completion. Closing the iterator stops the runs; they can be continued.
    """
    ray = _ray()
    here = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(
        ray.get_runtime_context().get_node_id(), soft=False
    )
    board = ray.remote(num_cpus=0)(_Board).options(scheduling_strategy=here).remote()
    train = ray.remote(num_cpus=1, max_retries=0)(_train)
    plugins = allowed_plugins()
    deaths: Counter[Path] = Counter()

    def give(job: Job) -> Any:
        return train.remote(job, plugins, board)

    pending = {give(job): job for job in jobs}
    try:
        while pending:
            ready, _ = ray.wait(list(pending), timeout=POLL_S)
            report(ray.get(board.take.remote()))
            for task in ready:
                job = pending.pop(task)
                try:
                    yield End(job, *ray.get(task))
                except ray.exceptions.RayTaskError as error:  # before the training began
                    yield End(job, "unfinished", one_line(error.as_instanceof_cause()))
                except ray.exceptions.RayError as error:
                    end = given_up(deaths, job, f"{job[1]} was lost: {one_line(error)}", say)
                    if end:
                        yield end
                    else:
                        pending[give(job)] = job
    finally:
        for task in pending:
            ray.cancel(task, force=True)
        ray.kill(board)
