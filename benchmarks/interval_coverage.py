"""How often the printed intervals hold the truth, at 5, 10 and 20 seeds.

python -m benchmarks.interval_coverage

Scores are drawn from a normal law, from one where a fifth of the runs fails, and steps from a
log-normal one. Writes docs/results/interval_coverage.csv.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from agents.files import write_text
from agents.reporting.bootstrap import Array, Interval
from agents.reporting.small_samples import ENOUGH, iqm_difference_t, iqm_t, mean_ratio_t
from agents.reporting.statistics import iqm, iqm_difference, iqm_interval
from agents.reporting.survival import speed_up

TABLE = Path(__file__).resolve().parent.parent / "docs" / "results" / "interval_coverage.csv"
SEEDS = (5, 10, 20)
TRIALS = 2000
REPS = 500

Draw = Callable[[np.random.Generator, int], Array]


def _normal(rng: np.random.Generator, n: int) -> Array:
    return rng.normal(0.6, 0.03, n)


def _failing(rng: np.random.Generator, n: int) -> Array:
    return np.where(rng.random(n) < 0.2, rng.normal(0.1, 0.03, n), rng.normal(0.6, 0.03, n))


def _steps(rng: np.random.Generator, n: int) -> Array:
    return 20_000 * rng.lognormal(0.0, 0.2, n)


LAWS: dict[str, Draw] = {"normal": _normal, "a fifth fails": _failing, "log-normal steps": _steps}


def intervals(law: str, x: Array, y: Array, seed: int) -> Iterator[tuple[str, str, Interval]]:
    """Yield (statistic, method, interval) for two arms of the same law."""
    settings: Any = {"seed": seed, "reps": REPS}
    if law == "log-normal steps":
        yield "ratio of means", "log-t", mean_ratio_t(x, y)
        yield "ratio of means", "percentile bootstrap", speed_up([x], [y], **settings)
        return
    yield "IQM", "Yuen's t", iqm_t(x)
    yield "IQM", "percentile bootstrap", iqm_interval([x], **settings)
    yield "difference of IQMs", "Yuen's t", iqm_difference_t(x, y)
    yield "difference of IQMs", "percentile bootstrap", iqm_difference([x], [y], **settings)


def coverage(law: str, n: int, trials: int = TRIALS) -> dict[tuple[str, str], float]:
    """Return the share of intervals that hold the truth, by statistic and method.

    Parameters
    ----------
    law : str
        A key of `LAWS`.
    n : int
        Seeds an arm.
    trials : int
        Simulated comparisons.
    """
    rng = np.random.default_rng([n, *law.encode()])
    middle = float(iqm(LAWS[law](np.random.default_rng(0), 1_000_000)))
    truth = {"IQM": middle, "difference of IQMs": 0.0, "ratio of means": 1.0}
    held: dict[tuple[str, str], list[bool]] = {}
    for trial in range(trials):
        x, y = LAWS[law](rng, n), LAWS[law](rng, n)
        for statistic, method, found in intervals(law, x, y, trial):
            inside = found.low <= truth[statistic] <= found.high
            held.setdefault((statistic, method), []).append(inside)
    return {key: float(np.mean(values)) for key, values in held.items()}


def main() -> None:
    """Write the table; "printed" marks the method that reports use at that number of seeds."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["law", "statistic", "method", "seeds", "coverage", "printed"])
    for law in LAWS:
        for n in SEEDS:
            for (statistic, method), share in coverage(law, n).items():
                printed = (method == "percentile bootstrap") == (n >= ENOUGH)
                writer.writerow([law, statistic, method, n, f"{share:.3f}", printed])
    write_text(TABLE, text.getvalue())
    print(text.getvalue())


if __name__ == "__main__":
    main()
