"""The report as one self-contained HTML page: one script of its own, nothing fetched."""

import base64
from collections.abc import Iterable
from dataclasses import dataclass
from html import escape

from agents.reporting.interactive import POLICY, STYLE, interactive
from agents.reporting.summary import Summary
from agents.reporting.tables import Rows, arm_table, comparison_table, trend_table
from agents.reporting.wording import answer, reporting_block, verdict, warnings

CSS = """
:root { color-scheme: light dark; --ink: #1c1e21; --soft: #5b6168; --page: #fdfdfc; --card: #f3f4f2;
  --line: #d9dbd7; --good: #0a6a3f; --bad: #a3330b; --warn-ink: #6b4700; --warn: #fff2cc; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e7e8; --soft: #a2a9b0; --page: #16181b;
  --card: #202327; --line: #3a3e44; --good: #62d39c; --bad: #ff9d76; --warn-ink: #ffdf94;
  --warn: #3d3110; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 72rem; padding: 2rem 1.25rem 4rem; background: var(--page);
  color: var(--ink); font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .3rem; }
h2 { font-size: 1.2rem; margin: 2.4rem 0 .7rem; }
p { margin: .4rem 0; max-width: 68ch; }
.soft, figcaption, dt { color: var(--soft); }
.note { display: inline-block; padding: .05rem .6rem; border-radius: 1rem; background: var(--warn);
  color: var(--warn-ink); font-weight: 600; }
.warning { margin: 1rem 0; padding: .6rem 1rem; border-left: 4px solid var(--warn-ink);
  background: var(--warn); color: var(--warn-ink); border-radius: 0 .4rem .4rem 0; }
.answers { list-style: none; margin: 1.2rem 0; padding: 0; }
.answers li { padding: .7rem 1rem; margin: .5rem 0; background: var(--card); border-radius: .5rem; }
.answers p { max-width: none; margin: .1rem 0; }
.better { color: var(--good); } .worse { color: var(--bad); }
figure { margin: 1.2rem 0; }
figure img { display: block; max-width: 100%; height: auto; background: #fff; padding: .4rem;
  border: 1px solid var(--line); border-radius: .5rem; }
figcaption { font-size: .88rem; margin-top: .3rem; max-width: 80ch; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: .84rem; font-variant-numeric: tabular-nums; }
th, td { padding: .35rem .6rem; text-align: left; border-bottom: 1px solid var(--line);
  vertical-align: bottom; }
td { white-space: nowrap; }
caption { text-align: left; padding: .6rem; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .2rem 1.2rem; margin: 0; }
dd { margin: 0; }
"""

DEFINITIONS = (
    ("AUC", "area under the success rate over environment steps, divided by the range; in [0, 1]"),
    ("AUC SD", "standard deviation across seeds, which more seeds do not shrink"),
    ("IQM", "mean over the middle half of the seeds (all seeds below four)"),
    (
        "Restricted mean steps",
        "area under the Kaplan–Meier curve up to the budget; a run that never gets there counts "
        "with the whole budget, so where many do, the ratio of two arms is pulled towards 1",
    ),
    (
        "Reached",
        "first evaluation with the success rate at or above the threshold, even if it falls "
        "back later; known to the spacing of the evaluations",
    ),
    ("Speed-up", "restricted mean steps of the baseline divided by those of the arm"),
    (
        "First crossing, sustained",
        "steps to the first evaluation at the threshold, and to the one after which none falls "
        "below it",
    ),
    (
        "≤, ≥, ?",
        "runs that never got there count with the budget, so the ratio of steps is a bound: the "
        "true one is smaller, larger, or could be either where both arms have such runs",
    ),
    ("P(better)", "chance that a random seed has a higher AUC than one of the baseline; ties half"),
    (
        "Verdict",
        "“better” or “worse” only if the interval of the AUC difference excludes no difference; "
        "AUC of success is the primary score, steps to the threshold are secondary",
    ),
    (
        "p-values",
        "Welch test of the AUCs and log-rank test of the steps, each Holm-adjusted over all "
        "comparisons of the table",
    ),
    (
        "Interval of no width",
        "every resample gave the same value, as when all seeds of one arm beat all of the other; "
        "it does not mean certainty",
    ),
    (
        "Pooling",
        "all tasks: the IQM pools seeds of every task; P and steps are averaged over tasks",
    ),
)


@dataclass(frozen=True)
class Picture:
    """A rendered figure: file name, alternative text, caption, PNG bytes."""

    file: str
    alt: str
    caption: str
    png: bytes


def _table(rows: Rows, caption: str) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows[1:]
    )
    return (
        f'<div class="scroll"><table><caption class="soft">{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>"
    )


def _answers(summary: Summary) -> str:
    study, items = summary.study, []
    # The average is the shortest true answer, so it leads.
    for row in (*summary.pooled, *summary.comparisons):
        word = verdict(row)
        # Colour is for claims, and a smoke result is none.
        tone, smoke = ("", " (smoke result)") if summary.smoke else (word.split()[0].lower(), "")
        text = escape(answer(row, study.threshold, int(study.env_steps[-1])))
        mark = f'<span class="{tone}">{word}{smoke}</span>'
        items.append(f"<li><p><strong>{escape(row.task)}: {mark}</strong></p><p>{text}</p></li>")
    if not items:
        items = ["<li><p><strong>No comparison is possible yet.</strong></p></li>"]
    return '<ul class="answers">' + "\n".join(items) + "</ul>"


def _definitions(pairs: Iterable[tuple[str, str]]) -> str:
    return "<dl>" + "".join(f"<dt>{escape(k)}</dt><dd>{escape(v)}</dd>" for k, v in pairs) + "</dl>"


def _picture(picture: Picture) -> str:
    data = base64.b64encode(picture.png).decode()
    return (
        f'<figure><img src="data:image/png;base64,{data}" alt="{escape(picture.alt)}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )


def _lost_runs(summary: Summary) -> str:
    lost = [run for run in summary.study.runs if run.status != "done"]
    if not lost:
        return "<p>Every planned run is finished.</p>"
    rows = [[run.arm, str(run.seed), run.status] for run in lost]
    return _table([["Arm", "Seed", "Status"], *rows], "Runs that are missing or failed")


def page(summary: Summary, pictures: Iterable[Picture]) -> str:
    """Lay out the whole page; all text from the study is escaped."""
    study = summary.study
    note = f'<p><span class="note">{escape(study.note)}</span></p>' if study.note else ""
    alerts = "".join(f'<p class="warning">{escape(text)}</p>' for text in warnings(summary))
    compared = ""
    if summary.comparisons:
        compared = _table(comparison_table(summary), f"Against the baseline {study.baseline}")
    if summary.trends:
        compared += _table(trend_table(summary), "How the difference grows with n")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<title>{escape(study.title)}</title>
<style>{CSS}{STYLE}</style>
</head>
<body>
<main>
<h1>{escape(study.title)}</h1>
<p class="soft">Study {escape(study.name)} · baseline: {escape(study.baseline)}</p>
{note}
{_answers(summary)}
{alerts}
<h2>Figures</h2>
{interactive(summary)}
{"".join(map(_picture, pictures))}
<h2>Numbers</h2>
{_table(arm_table(summary), "Every arm")}
{compared}
<h2>Reporting block</h2>
{_definitions(reporting_block(summary).items())}
<h2>Missing and failed runs</h2>
{_lost_runs(summary)}
<h2>How to read this</h2>
{_definitions(DEFINITIONS)}
</main>
</body>
</html>
"""
