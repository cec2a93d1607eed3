"""Where the runs of a study are carried out: a pool of processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing.queues import Queue
from pathlib import Path

from agents import files
from agents.learning.config import TrainConfig

Job = tuple[TrainConfig, Path]

_steps: Queue[int] | None = None


def _initialise(steps: Queue[int], parent: int) -> None:
    """Prepare a worker: one thread, and an end when the study's process dies."""
    global _steps
    _steps = steps

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)  # the study was killed; the next one resumes from the checkpoint

    threading.Thread(target=watch, daemon=True).start()


def _work(job: Job) -> str | None:
    """Train one run; return the traceback if it failed."""
    from agents.learning.training import train  # torch is loaded in the workers only

    config, folder = job
    assert _steps is not None
    try:
        train(config, folder, _steps.put)
    except Exception:
        text = traceback.format_exc()
        files.write_text(folder / files.FAILED, text)
        return text
    return None


def run_pool(
    jobs: list[Job], workers: int, report: Callable[[int], object]
) -> Iterator[tuple[Job, str | None]]:
    """Train all jobs in a process pool.

    Parameters
    ----------
    jobs : list of (TrainConfig, Path)
        Runs and their folders.
    workers : int
        Processes, one torch thread each.
    report : callable
        Called with environment steps as they are done.

    Yields
    ------
    job, error
        In order of completion; `error` is a traceback or None.
    """
    context = multiprocessing.get_context("spawn")
    steps: Queue[int] = context.Queue()
    os.environ["OMP_NUM_THREADS"] = "1"  # inherited by the workers, before they load torch
    with ProcessPoolExecutor(workers, context, _initialise, (steps, os.getpid())) as pool:
        futures: dict[Future[str | None], Job] = {pool.submit(_work, job): job for job in jobs}
        stop = threading.Event()

        def drain() -> None:
            while not (stop.is_set() and steps.empty()):
                try:
                    report(steps.get(timeout=0.2))
                except queue.Empty:
                    continue

        reader = threading.Thread(target=drain, daemon=True)
        reader.start()
        try:
            for future in as_completed(futures):
                try:
                    error = future.result()
                except Exception:  # a worker died: the others' results still count
                    error = traceback.format_exc()
                yield futures[future], error
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            stop.set()
            reader.join(timeout=2.0)
