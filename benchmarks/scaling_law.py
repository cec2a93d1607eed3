"""How the steps that raw needs over Clarke's grow with the number of tendons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agents.reporting.bootstrap import Array, Interval, bootstrap
from agents.reporting.small_samples import mean_ratio_t
from agents.reporting.statistics import iqm
from agents.reporting.wording import number, with_interval
from benchmarks.committed_scores import plain_table, registered, runs, seeds

REPLICATED_FROM = 475
"""First seed that was added when the pilot was known."""

FITTED, HELD_OUT = (3, 6, 11, 32, 64), 24


def power(n: float | Array, p: float) -> float | Array:
    """Return (n / 2)^p, 1 at two coordinates."""
    return (np.asarray(n, float) / 2.0) ** p


def linear(n: float | Array, b: float | Array) -> float | Array:
    """Return 1 + b (n - 2), 1 at two coordinates."""
    return 1.0 + b * (np.asarray(n, float) - 2.0)


def fit_power(n: Array, ratios: Array) -> Array:
    """Return p by least squares of the logarithms, for ratios (..., N)."""
    x = np.log(n / 2.0)
    return np.asarray(np.log(ratios) @ x / (x @ x))


def fit_linear(n: Array, ratios: Array) -> Array:
    """Return b by least squares of the logarithms, for ratios (..., N)."""
    grid = np.geomspace(1e-3, 2.0, 2000)
    model = np.log(linear(n, 1.0 * grid[:, None]))
    misses = ((np.log(ratios)[..., None, :] - model) ** 2).sum(axis=-1)
    return np.asarray(grid[misses.argmin(axis=-1)])


def ratios(arm: str) -> dict[int, Interval]:
    """Return mean steps of an arm over Clarke's, by n."""
    scores = runs("scaling")
    clarke = scores["n = 3", "clarke"].steps
    return {
        int(task.removeprefix("n = ")): mean_ratio_t(found.steps, clarke)
        for (task, name), found in scores.items()
        if name == arm
    }


@dataclass(frozen=True)
class Law:
    """A law of steps over n: its parameter, and what it says where it was not fitted."""

    name: str
    parameter: Interval
    predicted: float


def laws() -> list[Law]:
    """Return the power law and the linear law, with seeds resampled."""
    scores = runs("scaling")
    raw = [scores[f"n = {n}", "raw"].steps for n in FITTED]
    clarke = [scores["n = 3", "clarke"].steps]
    n = np.array(FITTED, float)
    found = []
    for name, fit, law in (("power", fit_power, power), ("linear", fit_linear, linear)):

        def parameter(ours: list[Array], theirs: list[Array], fit: object = fit) -> Array:
            means = np.stack([steps.mean(axis=1) for steps in ours], axis=-1)
            values = means / theirs[0].mean(axis=1)[:, None]
            return np.asarray(fit(n, values))  # type: ignore[operator]

        interval = bootstrap(parameter, raw, clarke, seed=0, reps=1000)
        found.append(Law(name, interval, float(law(HELD_OUT, interval.estimate))))
    return found


def best_law() -> Law:
    """Return the law that predicts the number of tendons that was left out."""
    seen = ratios("raw")[HELD_OUT].estimate
    return min(laws(), key=lambda law: abs(np.log(law.predicted / seen)))


def slope(arm: str) -> Interval:
    """Return the change of an arm's mean AUC for each doubling of n."""
    scores = runs("scaling")
    found = [(int(t.removeprefix("n = ")), r.auc) for (t, name), r in scores.items() if name == arm]
    x = np.log2([n for n, _ in found])
    weights = (x - x.mean()) / ((x - x.mean()) @ (x - x.mean()))

    def statistic(ours: list[Array]) -> Array:
        return np.asarray(weights @ np.array([values.mean(axis=1) for values in ours]))

    return bootstrap(statistic, [values for _, values in found], seed=0, reps=2000)


def scaling_table() -> str:
    """Return steps over Clarke's and AUC by n."""
    scores, raw, repaired = runs("scaling"), ratios("raw"), ratios("repaired")
    rows = [["n", "raw: steps / Clarke's", "repaired: steps / Clarke's", "AUC raw", "AUC repaired"]]
    for n in sorted(raw):
        pair = [scores[f"n = {n}", name].auc for name in ("raw", "repaired")]
        row = [f"{n} (not fitted)" if n == HELD_OUT else str(n)]
        row += [with_interval(raw[n]), with_interval(repaired[n])]
        rows.append([*row, *(number(float(iqm(values)), 3) for values in pair)])
    return plain_table(rows)


def scaling_words() -> dict[str, str]:
    """Return what the law over n adds."""
    law, fits = best_law(), {entry.name: entry for entry in laws()}
    return {
        "scaling_seeds": seeds(runs("scaling").values()),
        "scaling_more": seeds(runs("scaling", REPLICATED_FROM).values()),
        "scaling_registered": registered("scaling"),
        "scaling_table": scaling_table(),
        "power": with_interval(fits["power"].parameter),
        "linear": with_interval(fits["linear"].parameter, 3),
        "power_24": number(fits["power"].predicted),
        "linear_24": number(fits["linear"].predicted),
        "seen_24": with_interval(ratios("raw")[HELD_OUT]),
        "law": law.name,
        "raw_slope": with_interval(slope("raw"), 3, sign=True),
        "repaired_slope": with_interval(slope("repaired"), 3, sign=True),
        "independent": "contains 0" if not slope("repaired").excludes(0.0) else "excludes 0",
        "verdict_n": "not independent" if slope("repaired").excludes(0.0) else "independent",
        "raw_64": with_interval(ratios("raw")[64]),
        "repaired_64": with_interval(ratios("repaired")[64]),
    }
