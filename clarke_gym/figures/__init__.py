"""Figures of the transform: the ring of tendons, the manifold, the chain of spaces."""

from clarke_gym.figures.manifold import (
    draw_exploration,
    draw_manifold_in_cube,
    exploration_shares,
)
from clarke_gym.figures.ring import (
    FIGURES,
    draw_commutative_diagram,
    draw_tendon_ring,
    draw_tilted_ellipse,
    draw_virtual_displacement,
    save_all,
    tilted_ellipse,
)

__all__ = [
    "FIGURES",
    "draw_commutative_diagram",
    "draw_exploration",
    "draw_manifold_in_cube",
    "draw_tendon_ring",
    "draw_tilted_ellipse",
    "draw_virtual_displacement",
    "exploration_shares",
    "save_all",
    "tilted_ellipse",
]
