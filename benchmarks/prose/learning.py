"""What the README, the results and the page on the comparison say of the studies."""

from __future__ import annotations

import csv

import numpy as np

from agents.reporting.bootstrap import Array, bootstrap
from agents.reporting.small_samples import mean_difference_t
from agents.reporting.wording import number, with_interval
from benchmarks.committed_reports import ROWS, row
from benchmarks.committed_scores import DOCS, Runs, committed, runs, seeds
from benchmarks.exploration import PAGE as EXPLORATION
from benchmarks.mechanism import short_table
from benchmarks.prose.sources import arm, count, rows, span, text, validated
from benchmarks.scaling_law import ratios

HEADLINE_N = ("n = 3", "n = 4", "n = 6", "n = 8", "n = 11")
MUJOCO_N = ("n = 3", "n = 7", "n = 11")
TWO, THREE = "2 segments", "3 segments"


def _times(task: str, other: str) -> str:
    """Return how many times the steps of Clarke coordinates another arm needs."""
    arms = runs("headline")
    return number(arms[task, other].steps.mean() / arms[task, "clarke"].steps.mean(), 1)


def _lower(task: str) -> str:
    """Return by how much lower Clarke's final error is than raw's [mm]."""
    raw, clarke = (runs("headline")[task, name].final_error_mm for name in ("raw", "clarke"))
    return with_interval(mean_difference_t(raw, clarke))


def _main_effect(*pairs: tuple[str, str]) -> str:
    """Return the geometric mean of ratios of steps, one a pair of arms of the controls."""
    arms = [runs("controls")["n = 7", name].steps for pair in pairs for name in pair]

    def statistic(*drawn: list[Array]) -> Array:
        means = [np.log(one[0].mean(axis=1)) for one in drawn]
        ours, theirs = np.sum(means[::2], axis=0), np.sum(means[1::2], axis=0)
        return np.asarray(np.exp((ours - theirs) / len(pairs)))

    return with_interval(bootstrap(statistic, *([steps] for steps in arms), seed=0))


def _errors(study: str, tasks: tuple[str, ...], *names: str) -> list[float]:
    """Return interquartile means of the final tip error [mm]."""
    return [arm(study, t, name, "final_tip_error_mm").estimate for t in tasks for name in names]


def _rows_abroad(representation: str, trained_with: str = "") -> list[dict[str, str]]:
    """Return what policies do on other robots and physics than their own."""
    return [
        r
        for r in rows("results/quick/transfer.md")
        if r["representation"] == representation and trained_with in ("", r["trained with n"])
    ]


def _abroad(representation: str, trained_with: str = "") -> list[float]:
    """Return their tip errors [mm]."""
    return [float(r["tip error, mm"]) for r in _rows_abroad(representation, trained_with)]


def _slots(line: str) -> str:
    """Return a row of a table with every cell but the first as a number that is computed."""
    first, *cells = line.strip("| ").split(" | ")
    return f"| {first} | " + " | ".join(f"«{cell}»" for cell in cells) + " |"


def _table(before: str, head: str, study: str) -> str:
    """Return a table of the results as a sentence: what stands before it, its head, its rows."""
    lines = [before, head, "|" + "---|" * head.count(" |")]
    for entry in ROWS:
        if entry[0] == study:
            lines.append(_slots(row(*entry)))
    return "\n".join(lines)


def readme() -> list[str]:
    """Return the sentences of the README."""
    raw = [number(ratios("raw")[n].estimate, 1) for n in (11, 24, 64)]
    mended = [ratio.estimate for ratio in ratios("repaired").values()]
    percent = validated("hardware_mujoco", "mean tip error", "fast, no gravity", "% L")[0]
    return [
        f"the more so the more tendons there are: «{_times('n = 11', 'raw')}» times at n = 11",
        f"Over n («{seeds(runs('scaling').values())}» seeds) raw needs «{raw[0]}», «{raw[1]}» and "
        f"«{raw[2]}» times Clarke's steps at n = 11, 24",
        f"and a matched gain, stays at «{span(mended)}».",
        *map(_slots, short_table().strip().splitlines()[2:]),
        f"recorded robot («{percent:.1f}» %",
    ]


def _trend() -> str:
    """Return how the difference in AUC to raw grows with each doubling of n."""
    page = (DOCS / "results" / "headline" / "table.md").read_text(encoding="utf-8")
    lines = page.replace("\\", "").split("each doubling of n")[1].splitlines()
    return next(line for line in lines if line.startswith("| clarke |")).split(" | ")[1].strip(" |")


def results() -> list[str]:
    """Return the sentences of docs/results.md."""
    raw, clarke = (
        float(runs("headline")["n = 11", name].final_error_mm.mean()) for name in ("raw", "clarke")
    )
    all_ends = _errors("headline", HEADLINE_N, "raw", "raw_scaled", "clarke")
    coarse = _errors("headline_mujoco", MUJOCO_N[1:], "raw_scaled")
    fine = _errors("headline_mujoco", MUJOCO_N[1:], "raw", "clarke")
    controls = [
        number(arm("controls", "n = 7", name, "steps").estimate)
        for name in ("rotated", "two_tendon", "clarke")
    ]
    adapted = _abroad("raw, behind a Clarke adapter")
    ends = [text("segments", TWO, name, "final_success") for name in ("raw", "clarke")]
    few = "| | n = 3 | n = 7 | n = 11 |"
    reached = min(float(r["success"].split()[0]) for r in _rows_abroad("clarke", "3"))
    return [
        f"the difference in AUC to raw grows by «{_trend()}» for each doubling",
        f"it reaches «{100 * reached:.0f}» of 100 held-out goals in all five runs",
        f"the more so the more tendons there are: «{_times('n = 11', 'raw')}» times at n = 11",
        _table("for each doubling of n.", "| | " + " | ".join(HEADLINE_N) + " |", "headline"),
        _table("intervals by Yuen's t and log-t):", few, "headline_mujoco"),
        _table('labelled "smoke"):', few, "quick"),
        _table("[report](results/quick_mujoco/report.html)):", few, "quick_mujoco"),
        f"at n = 3 and 4, and «{_times('n = 11', 'raw_scaled')}» times at n = 11.",
        f"All arms end at «{span(all_ends, 1)}» mm",
        f"n = 4 on (by «{_lower('n = 4')}» mm, and by «{_lower('n = 11')}» mm at n = 11: "
        f"«{number(clarke)}» against «{number(raw)}»)",
        f"in all five runs (median error «{span(_abroad('clarke', '3'))}» mm,",
        f"reaches every goal, too («{span(adapted)}» mm)",
        f"ends at «{span(coarse, 1)}» mm for n = 7 and 11 where raw and Clarke end at "
        f"«{span(fine, 1)}» mm",
        f"a higher AUC of success («{text('segments', TWO, 'clarke', 'auc_difference')}»)",
        f"reach 50 % in «{text('segments', TWO, 'clarke', 'steps')}» of raw's",
        f"raw ends higher: «{ends[0]}» success at the budget against «{ends[1]}».",
        f"difference is shown (AUC «{text('segments', THREE, 'clarke', 'auc_difference')}»)",
        f"turned by an angle («{controls[0]}») and the displacements of two tendons "
        f"(«{controls[1]}») learn as fast as Clarke coordinates («{controls[2]}»)",
    ]


def _explored() -> list[str]:
    """Return the rows of the table of untrained policies."""
    found = {r["representation"]: r for r in rows(EXPLORATION)}

    def cells(name: str, what: str, digits: int) -> str:
        values = [number(float(found[name][f"{what}, n = {n}"]), digits) for n in (3, 7, 11)]
        return values[0] if len(set(values)) == 1 else " / ".join(values)

    said = []
    for shown in ("raw, projected", "raw_scaled", "two_tendon", "random_basis", "arc_polar"):
        name = shown.split(",")[0]
        moved, seen = cells(name, "tip motion", 2), cells(name, "dome", 0)
        said.append(f"| {shown} | «{moved}» mm | «{seen}» % |")
    moved, seen = cells("clarke", "tip motion", 2), cells("clarke", "dome", 0)
    common = cells("clarke_common", "dome", 0)
    said.append(
        f"| clarke, rotated, clarke_common | «{moved}» mm for all n | «{seen}» "
        f"(common: «{common}») % |"
    )
    return said


def _covered() -> list[str]:
    """Return the rows of the table of simulated coverage."""
    with (DOCS / "results" / "interval_coverage.csv").open(encoding="utf-8") as file:
        found = list(csv.DictReader(file))
    plain = [r for r in found if r["law"] != "a fifth fails"]
    said = []
    for n in ("5", "10", "20"):
        cells = [f"{float(r['coverage']):.2f}" for r in plain if r["seeds"] == n]
        pairs = [" / ".join(cells[k : k + 2]) for k in (0, 2, 4)]
        said.append(_slots(f"| {n} | {' | '.join(pairs)} |"))
    failing = [
        float(r["coverage"])
        for r in found
        if (r["law"], r["statistic"], r["method"])
        == ("a fifth fails", "difference of IQMs", "Yuen's t")
    ]
    said.append(f"Yuen's interval of a difference covers «{span(failing)}»")
    return said


def _controls() -> list[str]:
    """Return the ratios of the controls."""
    readings = {
        "clarke": "|",
        "rotated": "the direction",
        "two_tendon": "nor that",
        "raw_scaled": "most of the gain",
        "projected": "projecting",
    }
    said = [
        f"| {name} | «{text('controls', 'n = 7', name, 'steps')}» | {reading}"
        for name, reading in readings.items()
    ]
    for shown in ("act clarke, see raw", "act raw, see clarke"):
        name = shown.replace(",", "")
        said.append(f"| {shown} | «{text('controls', 'n = 7', name, 'steps')}» |")
    act = _main_effect(("act clarke see raw", "raw"), ("clarke", "act raw see clarke"))
    see = _main_effect(("act raw see clarke", "raw"), ("clarke", "act clarke see raw"))
    acting = _main_effect(("clarke", "act clarke see raw"))
    said += [
        f"the action side: main effect «{act}» over both ways of seeing",
        f"the observation side: main effect «{see}» over both ways of acting, "
        f"«{acting}» with Clarke actions",
        f"of «{count('controls', 'n = 7', 'random_basis', 'planned')}» runs | conditioning",
    ]
    return said


def _segments() -> list[str]:
    """Return the rows of the table of several segments."""
    said = []
    for task in (TWO, THREE):
        for name in ("raw", "raw_scaled", "clarke"):
            end = text("segments", task, name, "final_success")
            reached = f"reached by «{count('segments', task, name, 'reached')}» of 10"
            if name == "raw":
                cells = ["", "" if task == TWO else reached]
            else:
                gain = text("segments", task, name, "auc_difference")
                steps = f"«{text('segments', task, name, 'steps')}»" if task == TWO else reached
                cells = [f"«{gain}»", steps]
            said.append(f"| {task}, {name} | " + " | ".join([*cells, f"«{end}»"]) + " |")
    return [line.replace("|  |", "| |").replace("|  |", "| |") for line in said]


def _late(one: Runs, other: Runs) -> str:
    """Return the difference in success, averaged over the last five evaluations."""
    return with_interval(mean_difference_t(one.last_success, other.last_success), sign=True)


def _overtaken() -> int:
    """Return the environment steps at which raw's mean success first is above Clarke's."""
    study = committed("segments")
    mean = {
        one.representation: study.success(one).mean(axis=0) for one in study.arms if one.task == TWO
    }
    return int(study.env_steps[np.argmax(mean["raw"] > mean["clarke"])])


def comparison() -> list[str]:
    """Return the sentences of docs/comparison.md."""
    mujoco = {
        score: [text("headline_mujoco", task, "clarke", score) for task in MUJOCO_N]
        for score in ("auc_difference", "steps", "steps_to_stay")
    }
    stay = [value.split()[0] for value in mujoco["steps_to_stay"]]
    scaled = row("headline_mujoco", "steps", "clarke", "raw_scaled").strip("| ").split(" | ")[1:]
    coarse = _errors("headline_mujoco", MUJOCO_N[1:], "raw_scaled")
    fine = _errors("headline_mujoco", MUJOCO_N[1:], "raw", "clarke")
    arms = runs("segments")
    late = _late(arms[TWO, "clarke"], arms[TWO, "raw"])

    def listed(values: list[str]) -> str:
        return ", ".join(f"«{value}»" for value in values)

    return [
        *_explored(),
        *_covered(),
        *_controls(),
        f"Clarke minus raw, {listed(mujoco['auc_difference'])} for n = 3, 7, 11",
        f"Clarke / raw, {listed(mujoco['steps'])}, and {listed(stay)} to stay there; "
        f"Clarke / scaled raw {listed(scaled)}.",
        f"Scaled raw ends with «{span(coarse, 1)}» mm of tip error for n = 7 and 11, raw and "
        f"Clarke with «{span(fine, 1)}» mm",
        *_segments(),
        f"with two segments raw is ahead for the first time after «{_overtaken():,}» steps.",
        f"evaluations the difference in success is «{late}»",
    ]
