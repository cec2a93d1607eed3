"""Where the runs of a study are carried out: processes on this machine, one run each at a time.

A process that dies costs its own run's last minutes alone: the run goes to a new one, which
continues from the checkpoint, at most `MAX_DEATHS` times.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, Literal

from agents.learning.config import TrainConfig
from agents.plugins import allow_plugins, allowed_plugins

Job = tuple[TrainConfig, Path]
Outcome = Literal["done", "failed", "unfinished"]

MAX_DEATHS = 3
"""Times that a run is given to a new process after its own has died."""

_GRACE_S = 2.0
"""Seconds that a stopped process may take to end."""


@dataclass(frozen=True)
class End:
    """How a run ended: `outcome`, and one line that says why where it is not done.

    ``failed`` is a result (the policy is no longer finite, or its noise has collapsed),
    ``unfinished`` a fault of the machine or the folder: the next study continues the run.
    """

    job: Job
    outcome: Outcome
    reason: str = ""


def one_line(error: BaseException) -> str:
    r"""Return an error as one line.

    Examples
    --------
    >>> one_line(ValueError("too\nlarge"))
    'ValueError: too large'
    """
    text = "".join(traceback.format_exception_only(error))
    return " ".join(text.split())


def carry_out(job: Job, report: Callable[[int], object]) -> tuple[Outcome, str]:
    """Train one run in this process, and return how it ended and why.

    Parameters
    ----------
    job : (TrainConfig, Path)
        A run and its folder.
    report : callable
        Called with environment steps as they are done.
    """
    from agents.learning.training import LearningFailure, train  # loads torch

    try:
        train(*job, report)
    except LearningFailure as error:
        return "failed", one_line(error)
    except Exception as error:
        return "unfinished", one_line(error)
    return "done", ""


def given_up(
    deaths: Counter[Path], job: Job, reason: str, say: Callable[[str], object]
) -> End | None:
    """Count the death of a run's process, and return its end where there were too many.

    Parameters
    ----------
    deaths : Counter
        Deaths so far, by folder.
    job : (TrainConfig, Path)
    reason : str
        What happened.
    say : callable
        Called with a line where the run goes on.
    """
    deaths[job[1]] += 1
    if deaths[job[1]] > MAX_DEATHS:
        return End(job, "unfinished", reason)
    say(f"{reason}; continuing it ({deaths[job[1]]} of {MAX_DEATHS} times)")
    return None


def _serve(pipe: Connection, parent: int, plugins: list[str]) -> None:
    """Train what comes through the pipe; end when the study's process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study stops its processes itself
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)  # the study was killed; the next one resumes from the checkpoint

    threading.Thread(target=watch, daemon=True).start()
    allow_plugins(plugins)
    while True:
        pipe.send(carry_out(pipe.recv(), pipe.send))


def memory_kills() -> int:
    """Return how many processes the system has killed for lack of memory since it started."""
    try:
        lines = Path("/proc/vmstat").read_text().splitlines()
    except OSError:
        return 0
    return next((int(line.split()[1]) for line in lines if line.startswith("oom_kill ")), 0)


class _Worker:
    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        arguments = (theirs, os.getpid(), allowed_plugins())
        self.process = context.Process(target=_serve, args=arguments, daemon=True)
        self.process.start()
        theirs.close()
        self.kills = memory_kills()
        self.job: Job | None = None

    def give(self, job: Job) -> None:
        self.job = job
        self.pipe.send(job)

    def receive(self) -> Any:
        """Return what the process sent; None if it has died."""
        try:
            return self.pipe.recv()
        except (EOFError, OSError):
            return None

    def death(self) -> str:
        """Say how the process died."""
        self.process.join(_GRACE_S)
        code = self.process.exitcode
        if code == -signal.SIGKILL and memory_kills() > self.kills:
            return "was killed by the system for lack of memory; use fewer --workers"
        if code is not None and code < 0:
            return f"was killed by {signal.Signals(-code).name}"
        return f"ended with exit code {code}"


def run_pool(
    jobs: list[Job],
    workers: int,
    report: Callable[[int], object],
    say: Callable[[str], object] = print,
) -> Generator[End, None, None]:
    """Train all jobs in processes of one torch thread each.

    Parameters
    ----------
    jobs : list of (TrainConfig, Path)
        Runs and their folders.
    workers : int
        Processes.
    report : callable
        Called with environment steps as they are done.
    say : callable
        Called with a line when a process has died and its run goes on in another.

    Yields
    ------
    End
        In order of completion. Closing the iterator kills the processes; their runs can be
        continued.
    """
    os.environ["OMP_NUM_THREADS"] = "1"  # inherited by the workers, before they load torch
    todo = deque(jobs)
    deaths: Counter[Path] = Counter()
    pool: list[_Worker] = []
    try:
        for _ in range(min(workers, len(jobs))):
            pool.append(_Worker())
            pool[-1].give(todo.popleft())
        while pool:
            ready = wait([worker.pipe for worker in pool])
            for worker in [worker for worker in pool if worker.pipe in ready]:
                message = worker.receive()
                if isinstance(message, int):
                    report(message)
                    continue
                job = worker.job
                assert job is not None
                if message is not None:
                    yield End(job, *message)
                    if todo:
                        worker.give(todo.popleft())
                    else:
                        _stop([worker])
                        pool.remove(worker)
                    continue
                pool.remove(worker)
                end = given_up(deaths, job, f"the process of {job[1]} {worker.death()}", say)
                if end:
                    yield end
                else:
                    todo.appendleft(job)
                if todo:
                    pool.append(_Worker())
                    pool[-1].give(todo.popleft())
    finally:
        _stop(pool)


def _stop(pool: list[_Worker]) -> None:
    """Kill processes at once; what they write is whole or not there."""
    for worker in pool:
        worker.process.kill()
    for worker in pool:
        worker.process.join(_GRACE_S)
        worker.pipe.close()
