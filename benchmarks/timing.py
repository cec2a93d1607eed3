"""Side-by-side timing: rounds in turn, medians, ratios."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

Workload = Callable[[], object]


def seconds_per_call(workloads: dict[str, Workload], rounds: int, calls: int) -> dict[str, float]:
    """Return the median over rounds of the time of one call.

    Every round times each workload once, one after the other, so that a drift of the machine
    meets all of them.

    Parameters
    ----------
    workloads : dict
        Name -> function.
    rounds, calls : int
        Rounds, and calls timed together in each.

    Returns
    -------
    dict
        Name -> seconds a call.
    """
    times: dict[str, list[float]] = {name: [] for name in workloads}
    for work in workloads.values():  # warm up
        for _ in range(max(1, calls // 5)):
            work()
    for _ in range(rounds):
        for name, work in workloads.items():
            begin = time.perf_counter()
            for _ in range(calls):
                work()
            times[name].append((time.perf_counter() - begin) / calls)
    return {name: statistics.median(values) for name, values in times.items()}
