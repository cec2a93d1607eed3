"""What the gap between raw and Clarke is made of: the study that changes one cause at a time."""

from __future__ import annotations

import numpy as np

from agents.reporting.bootstrap import Interval
from agents.reporting.inside import TABLE, read_inside
from agents.reporting.small_samples import iqm_combination_t, iqm_t
from agents.reporting.statistics import holm, iqm, welch_p
from agents.reporting.wording import number, with_interval
from benchmarks.committed_scores import (
    DOCS,
    Runs,
    p_text,
    plain_table,
    registered,
    runs,
    seeds,
    signed,
    steps_over,
)

CLOSE = 0.02
"""An arm closes the gap where its difference to Clarke lies inside plus and minus this."""

PATH = (
    ("wide", "action box as wide as Clarke's"),
    ("wide noise", "noise as long on the manifold"),
    ("wide noise gain", "gain of the mean"),
    ("raw_scaled", "scale of the observations"),
    ("scaled marginal", "likelihood of what reaches the manifold"),
    ("scaled marginal see clarke", "two numbers an observation block, not n"),
    ("clarke", "rest: n outputs for two numbers"),
)
"""From raw to Clarke, one change a step: the arm that has it, and what changed."""

SINGLE = (
    ("wide", "raw", "action box"),
    ("wide noise", "wide", "noise, in the wide box"),
    ("wide gain", "wide", "gain of the mean, in the wide box"),
    ("see scaled", "raw", "scale of the observations"),
    ("see clarke", "see scaled", "number of the observations"),
    ("marginal", "raw", "likelihood"),
)
"""Each cause alone: the arm that has it, the arm that has not, and what changed."""

ARMS = {
    "raw": "n displacements",
    "wide": "raw, action box s times as wide",
    "wide noise": "wide, noise scaled by s",
    "wide gain": "wide, mean scaled by s",
    "wide noise gain": "scaled actions, raw observations",
    "see scaled": "raw actions, scaled observations",
    "raw_scaled": "actions and observations scaled by s",
    "see clarke": "raw actions, Clarke observations",
    "scaled see clarke": "scaled actions, Clarke observations",
    "marginal": "raw, marginal likelihood",
    "wide marginal": "wide, marginal likelihood",
    "scaled marginal": "scaled, marginal likelihood",
    "scaled marginal see clarke": "scaled actions, Clarke observations, marginal likelihood",
    "manifold noise": "raw, noise on the manifold alone, as long there as raw's",
    "manifold noise of clarke": "the same, as long as Clarke's",
    "modal": "raw actions turned so that two axes span the manifold",
    "clarke see raw": "Clarke actions, raw observations",
    "clarke nuisance": "Clarke and n - 2 actions that do nothing",
    "clarke nuisance marginal": "the same, marginal likelihood",
    "clarke": "two Clarke coordinates a segment",
}
"""Arms of the mechanism study in the order of the page, and what each is."""


def mechanism() -> dict[str, Runs]:
    """Return the arms of the mechanism study."""
    return {arm: scores for (_, arm), scores in runs("mechanism").items()}


def combination(weights: dict[str, float]) -> Interval:
    """Return a weighted sum of the arms' interquartile mean AUC."""
    arms = mechanism()
    used = {arm: w for arm, w in weights.items() if w}
    return iqm_combination_t([arms[arm].auc for arm in used], list(used.values()))


def effect(arm: str, without: str) -> Interval:
    """Return how much higher the AUC of one arm is than that of another."""
    return combination({arm: 1.0, without: -1.0})


def additivity() -> Interval:
    """Return the sum of the single effects minus the whole gap."""
    weights = dict.fromkeys(mechanism(), 0.0)
    for arm, without, _ in SINGLE:
        weights[arm] += 1.0
        weights[without] -= 1.0
    weights["clarke"] -= 1.0
    weights["raw"] += 1.0
    return combination(weights)


def share(arm: str) -> Interval:
    """Return the share of the gap that an arm closes (delta method)."""
    gap = effect("clarke", "raw").estimate
    part = effect(arm, "raw").estimate / gap
    if arm == "clarke":
        return Interval(part, part, part)
    around = combination({arm: 1.0, "raw": part - 1.0, "clarke": -part})
    reach = (around.high - around.low) / 2.0 / gap
    return Interval(part, part - reach, part + reach)


def closes(arm: str) -> bool:
    """Return whether an arm closes the gap by the rule that was registered."""
    if arm == "clarke":
        return True
    difference = effect(arm, "clarke")
    return difference.low > -CLOSE and difference.high < CLOSE


def adjusted() -> dict[str, float]:
    """Return Holm-adjusted p-values of every arm against raw (Welch test on AUC)."""
    arms = mechanism()
    others = [arm for arm in ARMS if arm != "raw"]
    values = holm([welch_p(arms[arm].auc, arms["raw"].auc) for arm in others])
    return dict(zip(others, map(float, values), strict=True))


def path_table() -> str:
    """Return the way from raw to Clarke, one change a row."""
    arms, rows = mechanism(), [["step", "arm that has it", "AUC", "change"]]
    rows.append(["raw", "raw", number(float(iqm(arms["raw"].auc)), 3), ""])
    before = "raw"
    for arm, what in PATH:
        rows.append([what, arm, number(float(iqm(arms[arm].auc)), 3), signed(effect(arm, before))])
        before = arm
    rows.append(["all together", "", "", signed(effect("clarke", "raw"))])
    return plain_table(rows)


def single_table() -> str:
    """Return each cause alone."""
    rows = [["cause alone", "arm", "against", "change of AUC"]]
    rows += [[what, a, b, signed(effect(a, b))] for a, b, what in SINGLE]
    rows.append(["sum of these - gap", "", "", signed(additivity())])
    return plain_table(rows)


def arm_table() -> str:
    """Return every arm against raw."""
    arms, p = mechanism(), adjusted()
    rows = [["arm", "what it is", "AUC", "minus raw", "p (Holm)"]]
    rows[0] += ["share of the gap", "closes it", "steps / raw's", "final error, mm"]
    for arm, what in ARMS.items():
        scores = arms[arm]
        row = [arm, what, with_interval(iqm_t(scores.auc), 3)]
        if arm == "raw":
            row += ["", "", "", "", ""]
        else:
            steps = steps_over(scores, arms["raw"])
            row += [signed(effect(arm, "raw")), p_text(p[arm]), with_interval(share(arm))]
            row += ["yes" if closes(arm) else "no", steps]
        rows.append([*row, number(float(iqm(scores.final_error_mm)))])
    return plain_table(rows)


SHORT = {
    "raw": "raw: n displacements",
    "raw_scaled": "raw times sqrt(n/2)",
    "scaled marginal": "the same, marginal likelihood",
    "scaled marginal see clarke": "the same, Clarke observations",
    "clarke": "Clarke coordinates",
}
"""Arms of the short table, and what they are called there."""


def short_table() -> str:
    """Return five rows for a reader in a hurry."""
    arms = mechanism()
    rows = [["n = 11", "AUC of success", "share of the gap", "steps / raw's", "final error, mm"]]
    for arm, name in SHORT.items():
        scores = arms[arm]
        row = [name, with_interval(iqm_t(scores.auc), 3)]
        if arm == "raw":
            row += ["0", "1"]
        else:
            steps = steps_over(scores, arms["raw"])
            row += ["1" if arm == "clarke" else with_interval(share(arm)), steps]
        rows.append([*row, number(float(iqm(scores.final_error_mm)))])
    return plain_table(rows)


def mechanism_words() -> dict[str, str]:
    """Return what the template's {names} of the mechanism stand for."""
    arms = mechanism()
    p = adjusted()
    gap = effect("clarke", "raw")
    found = {
        "seeds": seeds(arms.values()),
        "registered": registered("mechanism"),
        "raw_auc": number(float(iqm(arms["raw"].auc)), 3),
        "clarke_auc": number(float(iqm(arms["clarke"].auc)), 3),
        "gap": signed(gap),
        "path_table": path_table(),
        "single_table": single_table(),
        "arm_table": arm_table(),
        "short_table": short_table(),
        "additivity": signed(additivity()),
        "add_up": "contains 0" if not additivity().excludes(0.0) else "does not contain 0",
        "shown": ", ".join(f"`{a}`" for a in ARMS if a != "raw" and p[a] < 0.05),
        "not_shown": ", ".join(f"`{a}`" for a in ARMS if a != "raw" and not p[a] < 0.05) or "none",
        "closing": ", ".join(f"`{a}`" for a in ARMS if a != "clarke" and closes(a)) or "none",
    }
    for arm in ARMS:
        key = arm.replace(" ", "_")
        found[f"{key}_error"] = number(float(iqm(arms[arm].final_error_mm)))
        found[f"{key}_minus_clarke"] = signed(effect(arm, "clarke")) if arm != "clarke" else ""
        found[f"{key}_share"] = with_interval(share(arm))
        found[f"{key}_gain"] = signed(effect(arm, "raw")) if arm != "raw" else ""
    before = "raw"
    for arm, _ in PATH:
        found[f"step_{arm.replace(' ', '_')}"] = signed(effect(arm, before))
        before = arm
    for arm, without, _ in SINGLE:
        found[f"single_{arm.replace(' ', '_')}"] = signed(effect(arm, without))
    return found | inside_words()


INSIDE_AT = (10_000, 80_000)
"""Environment steps at which the page says what happened inside."""


def inside_words() -> dict[str, str]:
    """Return noise, saturation and clipping of some arms, early and late."""
    rows = read_inside(DOCS / "results" / "mechanism" / TABLE)
    found = {}
    for row in (row for row in rows if row.representation in ARMS):
        for name, digits in (("noise_on", 2), ("saturated", 3), ("clip_fraction", 2)):
            for steps in INSIDE_AT:
                value = row.values[name][np.abs(row.env_steps - steps).argmin()]
                key = f"{row.representation.replace(' ', '_')}_{name}_{steps // 1000}k"
                found[key] = number(float(value), digits)
    return found
