"""The Clarke transform of n joints in a ring; layouts, modes, manifold and tensions beside it."""

from clarke_gym.clarke.transform import (
    from_clarke,
    inverse_matrix,
    joint_angles,
    layout_matrices,
    project,
    projector,
    to_clarke,
    transform_matrix,
)

__all__ = [
    "from_clarke",
    "inverse_matrix",
    "joint_angles",
    "layout_matrices",
    "project",
    "projector",
    "to_clarke",
    "transform_matrix",
]
