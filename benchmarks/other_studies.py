"""What docs/why_clarke.md says of noise, tuning, MuJoCo, segments, algorithms and tasks."""

from __future__ import annotations

import json

import numpy as np

from agents.reporting.bootstrap import Array
from agents.reporting.inside import TABLE, Inside, read_inside
from agents.reporting.small_samples import iqm_difference_t, iqm_t, mean_difference_t
from agents.reporting.statistics import holm, iqm, welch_p
from agents.reporting.tuning import read_trials
from agents.reporting.wording import number, with_interval
from benchmarks.committed_scores import (
    DOCS,
    Runs,
    committed,
    p_text,
    plain_table,
    registered,
    runs,
    seeds,
    signed,
    steps_over,
)
from benchmarks.leaderboard import DATA, last_five

REPLICATED_FROM = 495
"""First seed of MuJoCo's study that was added when its pilot was known."""

TRIALS = DOCS / "results" / "tuned" / "tuning.csv"


def _gap(ours: Runs, theirs: Runs) -> str:
    """Return a difference in AUC with its interval."""
    return signed(iqm_difference_t(ours.auc, theirs.auc))


# --- initial noise ----------------------------------------------------------------------------


def at_best_noise(arm: str) -> Runs:
    """Return the runs of an arm with the initial noise at which its AUC is highest."""
    scores = [found for (_, name), found in runs("noise").items() if name == arm]
    return max(scores, key=lambda found: float(iqm(found.auc)))


def noise_table() -> str:
    """Return AUC by arm and initial noise, and the best of each arm against the best of Clarke."""
    scores = runs("noise")
    levels = list(dict.fromkeys(task for task, _ in scores))
    arms = list(dict.fromkeys(arm for _, arm in scores))
    rows = [["log of the initial noise", *levels, "best minus Clarke's best"]]
    for arm in arms:
        values = [number(float(iqm(scores[level, arm].auc)), 3) for level in levels]
        best = _gap(at_best_noise(arm), at_best_noise("clarke"))
        rows.append([arm, *values, "" if arm == "clarke" else best])
    return plain_table(rows)


# --- tuning -----------------------------------------------------------------------------------


def trials() -> dict[str, Array]:
    """Return the mean AUC of every configuration that was tried, by arm."""
    return {arm: scores.mean(axis=1) for arm, scores in read_trials(TRIALS).items()}


def tuning_table() -> str:
    """Return what tuning found for each arm, and the winners on seeds of their own."""
    scores, tried = runs("tuned"), trials()
    folders = {(arm.task, arm.representation): arm.name for arm in committed("tuned").arms}
    rows = [
        [
            "arm",
            "trials: best, median, worst AUC",
            "winner's AUC",
            "raw minus Clarke",
            "steps / Clarke's",
        ]
    ]
    for (task, arm), found in scores.items():
        values = tried[folders[task, arm]]
        spread = [number(float(v), 3) for v in (values.max(), np.median(values), values.min())]
        row = [f"{arm}, {task}", ", ".join(spread), with_interval(iqm_t(found.auc), 3)]
        clarke = scores[task, "clarke"]
        steps = steps_over(found, clarke)
        own = ["", "1"] if arm == "clarke" else [_gap(found, clarke), steps]
        rows.append([*row, *own])
    return plain_table(rows)


# --- MuJoCo and two segments ------------------------------------------------------------------


def adjusted(scores: dict[tuple[str, str], Runs], baseline: str) -> dict[tuple[str, str], float]:
    """Return the adjusted p of every arm against the one that it is compared with on its task."""
    others = [key for key in scores if key[1] != baseline]
    values = [welch_p(scores[k].auc, scores[k[0], baseline].auc) for k in others]
    return dict(zip(others, map(float, holm(values)), strict=True))


def replication_words() -> dict[str, str]:
    """Return what the seeds of MuJoCo's study say alone that were added to replicate its pilot.

    An arm with one of them tests nothing, and is in no family.
    """
    fresh = runs("repair_mujoco", REPLICATED_FROM)
    scores = {key: found for key, found in fresh.items() if len(found.auc) > 1}
    p = adjusted(scores, "raw")
    said: dict[bool, list[str]] = {True: [], False: []}
    for (task, arm), value in p.items():
        gap = _gap(scores[task, arm], scores[task, "raw"])
        said[value < 0.05].append(
            f"`{arm}` at a cap of {task.removeprefix('cap ')} ({gap}, p {p_text(value)})"
        )
    return {
        "mujoco_more": seeds(fresh.values()),
        "mujoco_replicated": _listed(said[True]),
        "mujoco_not_replicated": _listed(said[False]),
    }


def _listed(names: list[str]) -> str:
    return ", ".join(names) or "none"


def arms_rows(
    study: str, baseline: str, names: dict[str, str], in_mm: bool = True
) -> list[list[str]]:
    """Return a head, and every arm against the one that it is compared with on its task."""
    scores = runs(study)
    p = adjusted(scores, baseline)
    several = len({task for task, _ in scores}) > 1
    rows = [["arm", "AUC", f"minus {baseline}", "p (Holm)", "steps ratio", "last five"]]
    rows[0] += ["error, mm"] * in_mm
    for (task, arm), found in scores.items():
        row = [f"{names.get(arm, arm)}, {task}" if several else names.get(arm, arm)]
        row.append(with_interval(iqm_t(found.auc), 3))
        if arm == baseline:
            row += ["", "", "1"]
        else:
            against = scores[task, baseline]
            steps = steps_over(found, against)
            row += [_gap(found, against), p_text(p[task, arm]), steps]
        row.append(with_interval(iqm_t(found.last_success), 2))
        rows.append(row + [number(float(iqm(found.final_error_mm)))] * in_mm)
    return rows


def arms_table(study: str, baseline: str, names: dict[str, str], in_mm: bool = True) -> str:
    """Return the table of a study's arms."""
    return plain_table(arms_rows(study, baseline, names, in_mm))


SEGMENT_ARMS = {
    "wide": "raw, wide box",
    "wide noise of clarke": "raw, wide box, noise of Clarke",
    "clarke noise of raw": "Clarke, noise of raw",
    "clarke noise of clarke": "Clarke, noise of Clarke, not learnt",
    "clarke entropy": "Clarke, entropy bonus 0.01",
    "clarke bends": "the segments' own bends",
    "clarke 128": "Clarke, network of 2 x 128",
    "clarke": "Clarke",
}
"""Arms of the study with two segments, as the page calls them."""


def inside(study: str, task: str, arm: str) -> Inside:
    """Return what happened inside an arm of a committed study."""
    rows = read_inside(DOCS / "results" / study / TABLE)
    return next(row for row in rows if (row.task, row.representation) == (task, arm))


def slack_words() -> dict[str, str]:
    """Return how often commands are at the cap, and tendons slack, in the first and last update."""
    found = {"hold_raw_slack": number(float(inside("hold", "Hold", "raw").values["slack"][-1]))}
    for arm, cap in (("raw", "0.2"), ("raw", "1"), ("raw", "5"), ("projected", "0.2")):
        key, values = cap.replace(".", ""), inside("repair_mujoco", f"cap {cap} mm", arm).values
        for name in ("capped", "slack"):
            for when, update in (("early", 0), ("late", -1)):
                found[f"{arm}_{key}_{name}_{when}"] = number(float(values[name][update]))
    return found


def off_policy_words() -> dict[str, str]:
    """Return what the template's {names} of SAC and TD3 stand for."""
    scores, scaled = runs("off_policy"), runs("off_policy_scaled")
    found = {
        "off_seeds": seeds(scores.values()),
        "off_registered": registered("off_policy"),
        "off_table": arms_table("off_policy", "raw", {}),
        "scaled_registered": registered("off_policy_scaled"),
    }
    for algorithm in ("SAC", "TD3"):
        for n in (3, 11):
            pair = [scores[f"{algorithm}, n = {n}", arm] for arm in ("clarke", "raw")]
            found[f"{algorithm}_{n}"] = _gap(*pair)
    own = {algorithm: scaled[f"{algorithm}, n = 11", "raw_scaled"] for algorithm in ("SAC", "TD3")}
    pairs = {
        (name, arm): scores[f"{name}, n = 11", arm] for name in own for arm in ("raw", "clarke")
    }
    p = holm([welch_p(own[name].auc, other.auc) for (name, _), other in pairs.items()])
    for name, ours in own.items():
        found[f"{name}_scaled"] = with_interval(iqm_t(ours.auc), 3)
    for ((name, arm), other), value in zip(pairs.items(), p, strict=True):
        found[f"{name}_scaled_minus_{arm}"] = _gap(own[name], other)
        found[f"{name}_scaled_p_{arm}"] = p_text(float(value))
    found["off_auto"] = _gap(scores["SAC, n = 11", "raw auto"], scores["SAC, n = 11", "raw"])
    for arm in ("clarke", "raw"):
        last = scores["SAC, n = 11", arm].last_success
        found[f"SAC_last_{arm}"] = with_interval(iqm_t(last), 2)
    return found


FURTHER = {"hold": "Hold, MuJoCo", "nest": "Nest, difficulty 0", "sparse": "Reach, sparse reward"}
"""Further studies of a task each, and what the page calls them."""


def further_words() -> dict[str, str]:
    """Return what the template's {names} of further tasks stand for."""
    table: list[list[str]] = []
    found = {"further_seeds": seeds(r for study in FURTHER for r in runs(study).values())}
    for study, name in FURTHER.items():
        head, *rows = arms_rows(study, "raw", {}, in_mm=False)
        table = table or [head]
        table += [[f"{name}, {row[0]}", *row[1:]] for row in rows]
        found[f"{study}_registered"] = registered(study)
        scores = {arm: own for (_, arm), own in runs(study).items()}
        for arm, own in scores.items():
            found[f"{study}_{arm}_last"] = with_interval(iqm_t(own.last_success), 2)
            if arm != "raw":
                found[f"{study}_{arm}"] = _gap(own, scores["raw"])
    return found | {"further_table": plain_table(table)}


def suite_words() -> dict[str, str]:
    """Return what the template's {names} of the other tasks stand for."""
    scores = runs("suite")
    found = {
        "suite_seeds": seeds(scores.values()),
        "suite_registered": registered("suite"),
        "suite_table": arms_table("suite", "raw", {}, in_mm=False),
    }
    for (task, arm), own in scores.items():
        if arm != "raw":
            found[f"{task.replace(' ', '_')}_{arm}"] = _gap(own, scores[task, "raw"])
    return found


def longer_words() -> dict[str, str]:
    """Return by how much raw is ahead of Clarke at the end of the leaderboard's longer runs."""
    learned = json.loads(DATA.read_text(encoding="utf-8"))["learned"]
    words = {}
    for task in ("Pose", "Shape", "Gate"):
        raw, clarke = (np.array(last_five(learned[task][name])) for name in ("raw", "clarke"))
        words[f"{task}_longer"] = with_interval(mean_difference_t(raw, clarke), sign=True)
    return words


def other_words() -> dict[str, str]:
    """Return what the template's {names} of these studies stand for."""
    best = {arm: at_best_noise(arm) for arm in ("clarke", "raw n = 3", "raw n = 11")}
    found = {
        "noise_seeds": seeds(runs("noise").values()),
        "noise_registered": registered("noise"),
        "noise_table": noise_table(),
        "noise_raw_11": _gap(best["raw n = 11"], best["clarke"]),
        "noise_scaled_11": _gap(at_best_noise("scaled n = 11"), best["clarke"]),
        "noise_raw_3": _gap(best["raw n = 3"], best["clarke"]),
        "tuned_seeds": seeds(runs("tuned").values()),
        "tuning_table": tuning_table(),
        "mujoco_seeds": seeds(runs("repair_mujoco").values()),
        "mujoco_registered": registered("repair_mujoco"),
        "mujoco_table": arms_table("repair_mujoco", "raw", {}),
        "segments_seeds": seeds(runs("two_segments").values()),
        "segments_registered": registered("two_segments"),
        "segments_table": arms_table("two_segments", "clarke", SEGMENT_ARMS),
    }
    for task in ("n = 3", "n = 11"):
        pair = [runs("tuned")[task, arm] for arm in ("raw", "clarke")]
        key = task.replace(" = ", "_")
        found[f"tuned_gap_{key}"] = _gap(*pair)
        found[f"tuned_steps_{key}"] = steps_over(*pair)
    caps = runs("repair_mujoco")
    for arm in ("projected", "repaired", "clarke"):
        found[f"mujoco_{arm}"] = _gap(caps["cap 0.2 mm", arm], caps["cap 0.2 mm", "raw"])
    found |= off_policy_words() | suite_words() | further_words() | slack_words()
    found |= replication_words() | longer_words()
    clarke = runs("two_segments")["2 segments", "clarke"]
    for (_, arm), scores in runs("two_segments").items():
        name = arm.replace(" ", "_")
        found[f"segments_{name}_auc"] = _gap(scores, clarke)
        late = iqm_difference_t(scores.last_success, clarke.last_success)
        found[f"segments_{name}_late"] = with_interval(late, 2, sign=True)
    return found
