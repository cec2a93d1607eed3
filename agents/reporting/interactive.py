"""Learning curves to touch in the page: data, script and style, all inside it, nothing fetched."""

import base64
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.markers import MarkerStyle

from agents.reporting.bands import Band
from agents.reporting.bootstrap import Array
from agents.reporting.marks import Mark, marks_of
from agents.reporting.multiples import parts
from agents.reporting.summary import Summary
from agents.reporting.wording import metric_text

_HERE = Path(__file__).parent
SCRIPT = "\n" + (_HERE / "interactive.js").read_text(encoding="utf-8")
STYLE = (_HERE / "interactive.css").read_text(encoding="utf-8")

_HASH = base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
POLICY = (
    f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{_HASH}'; "
    "base-uri 'none'; form-action 'none'"
)
"""Content security policy of the page: this script runs and no other, and nothing is fetched."""


def script_json(data: Any) -> str:
    r"""Return data as JSON that is safe inside a script element.

    Parameters
    ----------
    data : object
        What `json` knows.

    Returns
    -------
    str
        ASCII without ``<``, ``>`` and ``&``: no text of a study can end the element.

    Examples
    --------
    >>> script_json(["</script>", "a & b"])
    '["\\u003c/script\\u003e","a \\u0026 b"]'
    """
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _numbers(values: Array) -> list[float | None]:
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values]


def _arm(name: str, mark: Mark) -> dict[str, str]:
    """Return how the page draws an arm: as the figures do, on a light and on a dark ground."""
    style = MarkerStyle(mark.marker)
    shapes: Any = style.get_path().transformed(style.get_transform()).to_polygons(closed_only=False)
    rings = ("L".join(f"{9 * x:.1f} {-9 * y:.1f}" for x, y in shape) for shape in shapes)
    dash = "none" if mark.line == "-" else " ".join(f"{2 * length:g}" for length in mark.line[1])
    return {
        "name": name,
        "light": mark.colour,
        "dark": mark.dark,
        "dash": dash,
        "marker": "".join(f"M{ring}Z" for ring in rings),
    }


def _curve(band: Band, arm: int) -> dict[str, Any]:
    return {
        "arm": arm,
        "centre": _numbers(band.centre),
        "low": _numbers(band.low),
        "high": _numbers(band.high),
    }


def curves_data(summary: Summary) -> dict[str, Any]:
    """Return what the script draws: arms, and for every panel its curves of two quantities.

    Parameters
    ----------
    summary : Summary

    Returns
    -------
    dict
        Plain data; numbers have four significant digits, NaN is None.
    """
    study = summary.study
    order = {name: i for i, name in enumerate(study.representations)}
    panels = []
    for task, heading, names in parts(study):
        metric = study.leading_of(task)
        here = [b for b in summary.bands if b.task == task and b.representation in names]
        drawn = [
            [_curve(b, order[b.representation]) for b in here if (b.metric is None) is success]
            for success in (True, False)
        ]
        quantities = ["success rate", metric.with_unit() if metric else ""]
        panels.append({"title": heading, "quantities": quantities, "curves": drawn})
    return {
        "arms": [_arm(*pair) for pair in marks_of(study.representations).items()],
        "quantities": ["success rate", metric_text(study)][: 1 + bool(study.leading)],
        "steps": study.env_steps.tolist(),
        "threshold": study.threshold,
        "panels": panels,
    }


def interactive(summary: Summary) -> str:
    """Return the section of the page; without JavaScript it stays hidden."""
    return (
        '<section id="curves" aria-label="Interactive learning curves" hidden>'
        '<p class="soft">IQM over seeds with pointwise 95 % band. Point at a curve, or go along it '
        "with the arrow keys, for its values; the buttons hide and show arms.</p>"
        "<svg hidden></svg></section>\n"
        f'<script type="application/json" id="curves-data">{script_json(curves_data(summary))}'
        f"</script>\n<script>{SCRIPT}</script>"
    )
