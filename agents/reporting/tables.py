"""Tables of a report, as rows of text for people and rows of numbers for machines."""

import csv
import html
import io
import json
import math
from collections.abc import Iterable

import numpy as np

from agents.reporting.bootstrap import NO_INTERVAL, Interval
from agents.reporting.cells import to_cell
from agents.reporting.results import Study
from agents.reporting.summary import ArmSummary, Summary
from agents.reporting.wording import DASH, number, steps_text, with_interval

Rows = list[list[str]]


def _median(arm: ArmSummary) -> str:
    return "not reached" if math.isinf(arm.median_steps) else number(arm.median_steps, 0)


def arm_table(summary: Summary) -> Rows:
    """One row for each arm, after a row of headings."""
    heading = ["Task", "Representation", "Runs", "AUC IQM [CI]", "Final success"]
    leading = summary.study.leading
    heading += [f"Final {metric.with_unit(', {}')}" for metric in leading]
    heading += ["Restricted mean steps", "Reached"]
    heading += ["P(better than baseline)", "Median steps", "AUC SD", "Optimality gap"]
    better = {(c.task, c.representation): c.p_better for c in summary.comparisons}
    rows = [heading]
    for arm in summary.arms:
        key = (arm.arm.task, arm.arm.representation)
        row = [*key, f"{arm.n} of {len(arm.arm.runs)}", with_interval(arm.auc, 3)]
        row += [with_interval(arm.final_success, 3)]
        row += [with_interval(arm.metrics.get(metric.name, NO_INTERVAL)) for metric in leading]
        row += [with_interval(arm.restricted_steps, 0), f"{arm.reached}/{arm.n}"]
        row += [with_interval(better[key]) if key in better else DASH, _median(arm)]
        row += [number(arm.auc_sd, 3), with_interval(arm.gap, 3)]
        rows.append(row)
    return rows


def comparison_table(summary: Summary) -> Rows:
    """One row for each comparison with the baseline, after a row of headings."""
    heading = ["Task", "Representation", "AUC difference [CI]", "Welch p (Holm)", "P(better) [CI]"]
    heading += ["Steps ratio, first crossing [CI]", "Steps ratio, sustained [CI]"]
    heading += ["Log-rank p (Holm)"]
    rows = [heading]
    for c in (*summary.comparisons, *summary.pooled):
        row = [c.task, c.representation, with_interval(c.auc_difference, 3, sign=True)]
        row += [number(c.welch_p, 4), with_interval(c.p_better)]
        row += [steps_text(c.steps_ratio, c.censored)]
        row += [steps_text(c.sustained_ratio, c.never_stayed)]
        rows.append([*row, number(c.logrank_p, 4)])
    return rows


def trend_table(summary: Summary) -> Rows:
    """One row for each slope over the number of tendons, after a row of headings."""
    heading = ["Representation", "AUC difference for each doubling of n [CI]"]
    rows = [[t.representation, with_interval(t.slope, 3, sign=True)] for t in summary.trends]
    return [heading, *rows]


def plain(text: str) -> str:
    r"""Return a text that Markdown shows as it is: names come from a file of somebody.

    Examples
    --------
    >>> print(plain("<script> | [a](b)"))
    &lt;script&gt; \| \[a\](b)
    """
    escaped = html.escape(" ".join(text.splitlines()), quote=False)
    for character in "\\|[]`*":
        escaped = escaped.replace(character, f"\\{character}")
    return escaped


def markdown(rows: Rows) -> str:
    r"""Lay rows out as a Markdown table.

    Examples
    --------
    >>> print(markdown([["a", "b"], ["1", "2|3"]]))
    | a | b |
    |---|---|
    | 1 | 2\|3 |
    """
    clean = [[plain(cell) for cell in row] for row in rows]
    lines = ["| " + " | ".join(row) + " |" for row in clean]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def _ends(name: str, interval: Interval) -> dict[str, float]:
    return {name: interval.estimate, f"{name}_low": interval.low, f"{name}_high": interval.high}


def _records(summary: Summary) -> Iterable[dict[str, object]]:
    found = {(c.task, c.representation): c for c in summary.comparisons}
    for s in summary.arms:
        metrics: dict[str, float] = {}
        for m in summary.study.metrics:
            metrics |= _ends(f"final_{m.shown_name}", s.metrics.get(m.name, NO_INTERVAL))
        record: dict[str, object] = {
            "task": to_cell(s.arm.task),
            "representation": to_cell(s.arm.representation),
            "arm": to_cell(s.arm.name),
            "planned": len(s.arm.runs),
            "finished": s.arm.count("done"),
            "failed": s.arm.count("failed"),
            **_ends("auc", s.auc),
            "auc_sd": s.auc_sd,
            **_ends("final_success", s.final_success),
            **_ends("optimality_gap", s.gap),
            **metrics,
            **_ends("restricted_mean_steps", s.restricted_steps),
            "median_steps": s.median_steps,
            "reached": s.reached,
        }
        c = found.get((s.arm.task, s.arm.representation))
        if c:
            record |= _ends("auc_difference", c.auc_difference) | _ends("p_better", c.p_better)
            record |= _ends("speed_up", c.speed_up)
            record |= _ends("sustained_speed_up", c.sustained_speed_up)
            record |= {"welch_p_holm": c.welch_p, "logrank_p_holm": c.logrank_p}
        yield record


def csv_text(summary: Summary) -> str:
    """Every number of every arm in full precision; empty where there is none."""
    records = list(_records(summary))
    columns = max(records, key=len)
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(columns), restval="", lineterminator="\n")
    writer.writeheader()
    for record in records:
        writer.writerow({k: "" if v != v else v for k, v in record.items()})
    return buffer.getvalue()


def _csv(heading: list[str], rows: Iterable[Iterable[object]]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(rows)
    return buffer.getvalue()


def curves_csv(study: Study) -> str:
    """Every evaluation of every finished run: what the curves are drawn from."""
    rows = []
    for arm in study.arms:
        for run, evals in arm.done:
            columns = [evals.is_success.mean(axis=1)]
            for m in study.metrics:
                values = evals.values.get(m.name)
                columns.append(
                    np.full(len(evals.env_steps), np.nan)
                    if values is None
                    else m.factor * values.mean(axis=1)
                )
            for steps, *scores in zip(evals.env_steps, *columns, strict=True):
                numbers = ["" if np.isnan(score) else f"{score:.6g}" for score in scores]
                labels = [to_cell(arm.task), to_cell(arm.representation)]
                rows.append([*labels, run.seed, steps, *numbers])
    heading = ["task", "representation", "seed", "env_steps", "success_rate"]
    return _csv([*heading, *(m.shown_name for m in study.metrics)], rows)


def runs_csv(study: Study) -> str:
    """Where every run comes from: its manifest in a row."""
    keys = ["git_sha", "git_dirty", "python", "machine", "threads", "wall_s", "cpu_s"]
    rows = (
        [to_cell(arm.task), to_cell(arm.representation), run.seed, run.status]
        + [to_cell(str(run.manifest.get(key, "unknown"))) for key in keys]
        + [json.dumps(run.manifest.get("packages", {}), sort_keys=True)]
        for arm in study.arms
        for run in arm.runs
    )
    return _csv(["task", "representation", "seed", "status", *keys, "packages"], rows)
