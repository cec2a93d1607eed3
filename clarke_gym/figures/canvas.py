"""What the figures share: colours, axes, and matplotlib only when a figure is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from clarke_gym.numerics.arrays import FloatArray

INK, BLUE, ORANGE, MAGENTA, GREY = "#222222", "#0072b2", "#d55e00", "#cc3d8f", "#999999"
"""Colours that stay apart for colour-blind eyes."""


def new_axes(axes: Any, three_d: bool = False) -> Any:
    """Return the given axes, or new ones."""
    if axes is not None:
        return axes
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError(
            "clarke_gym.figures.ring needs matplotlib: pip install 'clarke_gym[figures]'"
        ) from None
    figure = Figure(figsize=(4.6, 4.2), layout="constrained")
    return figure.add_subplot(projection="3d" if three_d else None)


def circle(radius: float, points: int = 361) -> FloatArray:
    """Return the points of a circle, shape (2, points)."""
    angle = np.linspace(0.0, 2.0 * np.pi, points)
    return radius * np.stack([np.cos(angle), np.sin(angle)])


def plane(axes: Any, title: str, unit: str) -> Any:
    """Give axes of a plane equal scales, labels and a title; return them."""
    axes.set_aspect("equal")
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(f"x [{unit}]")
    axes.set_ylabel(f"y [{unit}]")
    return axes
