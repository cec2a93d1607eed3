"""The report of a study: a self-contained HTML page, figures and tables, from its run folders."""

import json
from collections.abc import Callable
from pathlib import Path

from matplotlib.figure import Figure

from agents.files import refuse_links, write_bytes, write_text
from agents.metrics import FILE as METRICS
from agents.metrics import Metric, metrics_by_task_text
from agents.reporting import plots
from agents.reporting.bootstrap import REPS
from agents.reporting.failure_map import failure_map
from agents.reporting.house_style import FORMATS, rendered
from agents.reporting.html import Picture, page
from agents.reporting.inside import TABLE, inside_csv, load_inside
from agents.reporting.latex import latex
from agents.reporting.loading import load_study
from agents.reporting.methods import methods
from agents.reporting.results import ResultsError, Study
from agents.reporting.summary import Summary, summarise
from agents.reporting.tables import (
    Rows,
    arm_table,
    comparison_table,
    csv_text,
    curves_csv,
    markdown,
    plain,
    runs_csv,
    trend_table,
)
from agents.reporting.wording import answer, footer, metric_text, reporting_block, warnings

PAGE, OURS = "report.html", "report.json"
"""The page, and the names of the files that reports have written into the folder."""

Draw = Callable[[Summary, str], Figure | None]

# File, caption and function; {metric} becomes the label of the task's leading metric.
FIGURES: tuple[tuple[str, str, Draw], ...] = (
    (
        "learning_curves",
        "Success rate and {metric} over environment steps: IQM over seeds with pointwise 95 % "
        "bootstrap band; a thin line for each seed shows the spread. Dotted: the threshold. "
        "Dashed: classical control, the Clarke controller, on the same held-out goals.",
        plots.learning_curves,
    ),
    (
        "forest",
        "Difference in AUC of success to the baseline, the primary score, and speed-up to the "
        "threshold, with 95 % intervals, per task and over all tasks.",
        plots.forest,
    ),
    (
        "auc",
        "Normalised AUC of the success rate, the primary score: IQM with 95 % interval of that "
        "mean; the dots are seeds, whose spread is another thing.",
        plots.auc_points,
    ),
    (
        "inside",
        "Inside the runs: length of noise and mean actions in Clarke coordinates, on and off the "
        "manifold; commands off it, over the co-contraction limit that they may reach; slack "
        "tendons; and how far updates went. Means over seeds.",
        plots.inside,
    ),
    (
        "steps_to_threshold",
        "Share of runs that have reached the success threshold, from the Kaplan–Meier estimate; "
        "a bar at the end marks runs censored at the budget.",
        plots.survival,
    ),
    (
        "{metric}_profile",
        "Share of held-out goals whose final {metric} is τ or better: mean over seeds with 95 % "
        "band. Higher is better.",
        plots.profiles,
    ),
    (
        "failure_map",
        "Where held-out goals lie, seen along the robot's axis at rest, and the share of seeds "
        "that fail each at the last evaluation; a failed run fails every goal.",
        failure_map,
    ),
    (
        "wall_clock",
        "Success rate over wall-clock seconds, as a representation may also be cheaper per step. "
        "Runs that shared a machine slow each other.",
        plots.wall_clock,
    ),
)


def _tables(summary: Summary) -> list[Rows]:
    """Return the tables of results that a study has."""
    tables = [arm_table(summary)]
    tables += [comparison_table(summary)] if summary.comparisons else []
    tables += [trend_table(summary)] if summary.trends else []
    return tables


def _declared(study: Study) -> dict[str, list[Metric]]:
    """Return the metrics of each task, the leading one first."""
    return {
        task: list({m.name: m for arm in study.of_task(task) for m in arm.metrics}.values())
        for task in study.tasks
    }


def _markdown(summary: Summary) -> str:
    """Tables with the answer above and the reporting block below."""
    study = summary.study
    parts = [f"# {plain(study.title)}"]
    parts += [f"**{plain(study.note)}**"] if study.note else []
    rows = (*summary.pooled, *summary.comparisons)
    budget = int(study.env_steps[-1])
    answers = (f"{row.task}: {answer(row, study.threshold, budget)}" for row in rows)
    parts += [f"- {plain(text)}" for text in answers]
    parts += [f"> {plain(text)}" for text in warnings(summary)]
    parts += map(markdown, _tables(summary))
    parts += [markdown([["Reporting", ""], *map(list, reporting_block(summary).items())])]
    return "\n\n".join(parts) + "\n"


def _latex(summary: Summary) -> str:
    """Return the tables for a paper that uses booktabs, one after the other."""
    return "\n\n".join(map(latex, _tables(summary))) + "\n"


def write_report(
    study_dir: Path,
    out_dir: Path | None = None,
    *,
    reps: int = REPS,
    seed: int = 0,
    kinds: tuple[str, ...] = FORMATS,
) -> Path:
    """Write ``report.html``, its figures (PNG, SVG, PDF), the tables, and the data behind them.

    ``table.csv``, ``table.md`` and ``table.tex`` hold the results, ``methods.md`` the paragraph of
    a methods section, ``curves.csv`` every evaluation of every run, ``metrics.json`` what columns
    mean, ``runs.csv`` the manifests and ``diagnostics.csv`` what happened inside the runs.

    The same runs give the same bytes. Files of an earlier report, which ``report.json`` names, are
    replaced; others never are.

    Parameters
    ----------
    study_dir : Path
        Folder with ``study.yaml`` and the runs.
    out_dir : Path, optional
        Where to write; ``study_dir / "report"`` by default.
    reps, seed : int
        Replications and seed of every bootstrap.
    kinds : tuple of str
        Of `FORMATS`, with "png", which the page holds; half the time of a report goes into PDF.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    agents.reporting.results.ResultsError
        If the study cannot be read or has no finished run, or a file of somebody's is in the way.
    """
    study_dir = Path(study_dir)
    out_dir = study_dir / "report" if out_dir is None else Path(out_dir)
    return write_study(load_study(study_dir), out_dir, reps=reps, seed=seed, kinds=kinds)


def table_page(study: Study, *, reps: int = REPS, seed: int = 0) -> str:
    """Return ``table.md`` of a study."""
    return _markdown(summarise(study, seed=seed, reps=reps))


def write_study(
    study: Study,
    out_dir: Path,
    *,
    reps: int = REPS,
    seed: int = 0,
    kinds: tuple[str, ...] = FORMATS,
) -> Path:
    """As `write_report`, for a study that is loaded already."""
    summary = summarise(study, seed=seed, reps=reps)
    line = footer(summary)
    tasks = ", ".join(summary.study.tasks)
    pictures: list[Picture] = []
    contents: dict[str, bytes] = {}
    metric = metric_text(summary.study)
    for name, caption, draw in FIGURES:
        figure = draw(summary, line)
        if figure is not None:
            file = name.format(metric=metric).replace(" ", "_")
            files = {kind: rendered(figure, kind) for kind in kinds}
            contents |= {f"{file}.{kind}": data for kind, data in files.items()}
            caption = caption.format(metric=metric)
            alt = f"{caption.split(':')[0].rstrip('.')} ({tasks}). The numbers are in the tables."
            pictures.append(Picture(f"{file}.png", alt, caption, files["png"]))
    inside = load_inside(study)
    if inside:
        contents[TABLE] = inside_csv(inside).encode()
    contents |= {
        "table.csv": csv_text(summary).encode(),
        "curves.csv": curves_csv(summary.study).encode(),
        "runs.csv": runs_csv(summary.study).encode(),
        METRICS: metrics_by_task_text(_declared(study)).encode(),
        "table.md": _markdown(summary).encode(),
        "table.tex": _latex(summary).encode(),
        "methods.md": (plain(methods(summary)) + "\n").encode(),
        PAGE: page(summary, pictures).encode(),  # last: a page promises that the rest is there
    }
    _write(out_dir, contents)
    return out_dir / PAGE


def _write(out_dir: Path, contents: dict[str, bytes]) -> None:
    """Write a report's files, and before them which they are: others are never replaced."""
    out_dir.mkdir(parents=True, exist_ok=True)
    ours = out_dir / OURS
    refuse_links(out_dir, (OURS, *contents))
    try:
        earlier = set(json.loads(ours.read_text()))
    except FileNotFoundError:
        earlier = set()
    except (ValueError, TypeError) as error:
        raise ResultsError(f"{ours}: cannot be read: {error}") from error
    if strange := [name for name in contents if (out_dir / name).exists() and name not in earlier]:
        raise ResultsError(
            f"{out_dir / strange[0]} is not of an earlier report ({OURS} beside it would say so): "
            "nothing was changed; choose another --out or move that file away"
        )
    write_text(ours, json.dumps(sorted(earlier | set(contents)), indent=2) + "\n")
    for name, data in contents.items():
        write_bytes(out_dir / name, data)
