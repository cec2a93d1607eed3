"""The answer of a study in sentences, and the reporting block, both computed from the data."""

import math

from agents.reporting.bootstrap import LEVEL, Interval
from agents.reporting.results import Study
from agents.reporting.small_samples import ENOUGH
from agents.reporting.summary import ALL_TASKS, SMOKE_SEEDS, Comparison, Summary, bound

NAMES = {
    "raw": "raw tendon space",
    "raw_scaled": "scaled raw space (exploration matched)",
    "clarke": "Clarke coordinates",
}
DASH = "–"


def name_of(representation: str) -> str:
    """Name of a representation in a sentence."""
    return NAMES.get(representation, representation)


def number(value: float, digits: int = 2, sign: bool = False) -> str:
    """Fixed-point number; a dash for NaN.

    Examples
    --------
    >>> number(0.123), number(0.5, sign=True), number(-0.001, sign=True), number(float("nan"))
    ('0.12', '+0.50', '0.00', '–')
    """
    if math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    value = round(value, digits)
    return f"{value:{'+' if sign and value else ''},.{digits}f}".replace("-", "−" if value else "")


def percent(share: float) -> str:
    """Share of one as a percentage.

    Examples
    --------
    >>> percent(0.9), percent(0.975)
    ('90 %', '97.5 %')
    """
    return f"{100 * share:.3g} %"


def with_interval(interval: Interval, digits: int = 2, sign: bool = False) -> str:
    """Estimate and ends, or the estimate alone where there is no interval.

    Examples
    --------
    >>> with_interval(Interval(0.5, 0.4, 0.6))
    '0.50 [0.40, 0.60]'
    """
    text = number(interval.estimate, digits, sign)
    if not interval.known:
        return text
    return f"{text} [{number(interval.low, digits, sign)}, {number(interval.high, digits, sign)}]"


def verdict(row: Comparison) -> str:
    """Return one to three words: AUC of success decides, as declared."""
    area = row.auc_difference
    if not area.known:
        return "No interval"
    if not area.excludes(0):
        return "No difference shown"
    return "Better" if area.estimate > 0 else "Worse"


def steps_text(ratio: Interval, censored: tuple[int, int]) -> str:
    """Return a ratio of steps with its interval, as a bound where runs are censored.

    Examples
    --------
    >>> steps_text(Interval(0.5, 0.4, 0.6), (0, 2)), steps_text(Interval(0.5, 0.4, 0.6), (1, 2))
    ('≤ 0.50 [0.40, 0.60]', '? 0.50 [0.40, 0.60]')
    """
    return f"{bound(censored)} {with_interval(ratio)}".strip()


def _steps_clause(row: Comparison, threshold: float, budget: int) -> str:
    other, base = name_of(row.representation), name_of(row.baseline)
    ratio, goal = row.steps_ratio, f"{percent(threshold)} success"
    if not any(row.reached):
        return f"no run of either reached {goal} within {budget:,} steps"
    means = "mean over tasks of the " if row.task == ALL_TASKS else ""
    measure = f"{means}restricted mean to the first {goal}"
    limit = {"≤": "at most ", "≥": "at least ", "?": "(both arms censored) about ", "": ""}[
        bound(row.censored)
    ]
    if not ratio.known:
        alone = min(row.runs) < 2
        why = "a single seed" if alone else "an arm needed no steps"
        return (
            f"{other} needed {limit}{number(ratio.estimate)}× the environment steps of {base} "
            f"({measure}; no interval: {why}, so nothing can be concluded)"
        )
    ends = f"{percent(LEVEL)} CI {number(ratio.low)}–{number(ratio.high)}"
    if ratio.excludes(1):
        stay = f"{bound(row.never_stayed)} {number(row.sustained_ratio.estimate)}".strip()
        return (
            f"{other} needed {limit}{number(ratio.estimate)}× the environment steps of {base} "
            f"({measure}, {ends}; to stay there {stay}×)"
        )
    return (
        f"no difference shown between {other} and {base} in environment steps "
        f"({measure}, ratio {limit}{number(ratio.estimate)}, {ends})"
    )


def answer(row: Comparison, threshold: float, budget: int) -> str:
    """Return the finding of one comparison as a sentence, whichever way it falls."""
    area = row.auc_difference
    difference = with_interval(area, sign=True)
    if area.known and not area.excludes(0):
        auc_clause = f"no difference shown in AUC of success ({difference})"
    else:
        side = "higher" if area.estimate > 0 else "lower" if area.estimate < 0 else "equal"
        auc_clause = f"AUC of success of {name_of(row.representation)} was {side} ({difference})"
    chance = f"P({row.representation} > {row.baseline}) = {with_interval(row.p_better)}"
    steps = _steps_clause(row, threshold, budget)
    return f"{auc_clause[:1].upper()}{auc_clause[1:]}; {chance}; {steps}."


def metric_text(study: Study) -> str:
    """Label of the metric that leads, in a sentence."""
    labels = dict.fromkeys(metric.label for metric in study.leading)
    return labels.popitem()[0] if len(labels) == 1 else "leading metric"


def warnings(summary: Summary) -> list[str]:
    """Return what a reader must know before believing any number, most important first."""
    study, texts = summary.study, []
    if summary.smoke:
        texts.append(
            f"Smoke result: too few seeds for a claim ({summary.fewest_seeds} in the smallest arm; "
            f"{SMOKE_SEEDS} is the minimum, 20 for a headline)."
        )
    if not study.registration_holds:
        texts.append(
            "study.yaml is not what was registered: its question, rule, arms or settings have been "
            f"changed since (SHA-256 {study.registered[:12]})."
        )
    if any(arm.n == 1 for arm in summary.arms):
        texts.append("An arm with a single seed has no confidence interval; none is shown.")
    missing = [run for run in study.runs if run.status == "missing"]
    if missing:
        texts.append(
            f"Partial study: {len(missing)} of {len(study.runs)} runs are not finished and are in "
            "no statistic."
        )
    failed = sum(run.status == "failed" for run in study.runs)
    if failed:
        texts.append(
            f"{failed} failed runs count as success 0 at every evaluation; they have no "
            f"{metric_text(study)} and enter its profile as never reaching any level, but not its "
            "mean."
        )
    for task in study.tasks:
        if summary.find(task, study.baseline) is None:
            texts.append(f"{task}: no run of the baseline {study.baseline}, so no comparison.")
        for arm in study.of_task(task):
            if arm.representation != study.baseline and not summary.find(task, arm.representation):
                texts.append(f"{task}: no run of {arm.representation}, so nothing can be said.")
    return texts


def seeds_text(summary: Summary) -> str:
    """Seeds per arm, as a number or a range."""
    counts = sorted({arm.n for arm in summary.arms})
    return f"{counts[0]}–{counts[-1]}" if len(counts) > 1 else str(counts[0])


def code_text(study: Study) -> str:
    """Code versions of the runs: short hashes, marked where the tree was dirty."""
    versions = set()
    for run in study.runs:
        if run.status != "missing":
            sha = str(run.manifest.get("git_sha") or "unknown")
            versions.add(sha[:10] + ("+dirty" if run.manifest.get("git_dirty") else ""))
    return ", ".join(sorted(versions)) or "unknown"


def cpu_text(study: Study) -> str:
    """Total CPU hours, and of how many runs they are known."""
    counted = [run for run in study.runs if run.status != "missing"]
    known = [s for r in counted if isinstance(s := r.manifest.get("cpu_s"), int | float)]
    if not known:
        return "unknown"
    partial = (
        f" (known for {len(known)} of {len(counted)} runs)" if len(known) < len(counted) else ""
    )
    return f"{sum(known) / 3600:.2f}{partial}"


def added_seeds(summary: Summary) -> str:
    """Say how many seeds were planned, where more have been run; nothing otherwise."""
    planned, most = summary.study.planned_seeds, max(arm.n for arm in summary.arms)
    return f"{planned} seeds planned, {most} run" if planned and most > planned else ""


def reporting_block(summary: Summary) -> dict[str, str]:
    """Return what the protocol demands beside every figure, as label and value."""
    study = summary.study
    counted = [run for run in study.runs if run.status != "missing"]
    goals = sorted({evals.is_success.shape[1] for arm in study.arms for _, evals in arm.done})
    grid = study.env_steps
    block = {
        "Seeds per arm": seeds_text(summary),
        "Runs": f"{len(counted)} of {len(study.runs)}",
        "Tasks": ", ".join(study.tasks),
        "Evaluation": f"{'/'.join(map(str, goals))} held-out goals, {len(grid)} evaluations up to "
        f"{grid[-1]:,} steps",
        "Primary metric": "AUC of success (declared before the runs)",
        "Intervals": f"{percent(LEVEL)}; one task and fewer than {ENOUGH} seeds: Yuen's t for "
        "IQMs, log-t for steps and their ratios; else, and for P(better) and gaps, the percentile "
        "bootstrap of seeds within tasks, "
        f"{summary.reps} reps, seed {summary.seed}",
        "Tuning": study.tuning,
        "Code": code_text(study),
        "CPU hours": cpu_text(study),
        "Failures counted as zeros": str(sum(run.status == "failed" for run in counted)),
    }
    if study.registered:
        more = added_seeds(summary)
        block["Preregistered"] = (
            f"SHA-256 {study.registered[:12]} of question, rule and arms"
            + (f"; {more}" if more else "")
            + ("" if study.registration_holds else "; CHANGED since")
        )
    return block | ({"Note": study.note} if study.note else {})


def footer(summary: Summary) -> str:
    """Return the reporting block as one line for the foot of a figure."""
    items = [f"{key.lower()}: {value}" for key, value in reporting_block(summary).items()]
    smoke = ["SMOKE: too few seeds for a claim"] if summary.smoke else []
    return " · ".join([*smoke, *items])
