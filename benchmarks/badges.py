"""The badges of the README, from pyproject.toml: they need no network and say what it says.

python -m benchmarks.badges
"""

from __future__ import annotations

import re
import tomllib
from html import escape
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "docs" / "media" / "badges"

LEFT, RIGHT = "#444444", "#1f5f8b"
"""White text on either has a contrast of more than 6."""

CHARACTER, PADDING = 6.6, 8.0
"""Pixels."""


def facts() -> dict[str, str]:
    """Return what is said, by its name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    kinds = [
        re.fullmatch(r"Programming Language :: Python :: (3\.\d+)", c)
        for c in project["classifiers"]
    ]
    pythons = [found[1] for found in kinds if found]
    needs = [
        re.fullmatch(r"(gymnasium|mujoco)>=([\d.]+)", name) for name in project["dependencies"]
    ]
    return {
        "python": " | ".join(pythons),
        **{found[1]: f">= {found[2]}" for found in needs if found},
        "licence": project["license"],
    }


def badge(name: str, says: str) -> str:
    """Return a badge as SVG."""
    left, right = (round(2 * PADDING + CHARACTER * len(text)) for text in (name, says))
    width = left + right
    name, says = escape(name), escape(says)
    return f"""<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="20" role="img">
<title>{name}: {says}</title>
<clipPath id="round"><rect width="{width}" height="20" rx="3"/></clipPath>
<g clip-path="url(#round)">
<rect width="{left}" height="20" fill="{LEFT}"/>
<rect x="{left}" width="{right}" height="20" fill="{RIGHT}"/>
</g>
<g fill="#ffffff" text-anchor="middle" font-family="Verdana, sans-serif" font-size="11">
<text x="{left / 2:g}" y="14">{name}</text>
<text x="{left + right / 2:g}" y="14">{says}</text>
</g>
</svg>
"""


def main() -> None:
    """Write them."""
    FOLDER.mkdir(exist_ok=True)
    for name, says in facts().items():
        (FOLDER / f"{name}.svg").write_text(badge(name, says), encoding="utf-8")


if __name__ == "__main__":
    main()
