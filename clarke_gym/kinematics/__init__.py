"""Constant-curvature kinematics without singularities, and the chain of the paper's spaces."""

from clarke_gym.kinematics.arcs import (
    half_angle_functions,
)
from clarke_gym.kinematics.coupling import (
    bending_to_clarke,
    clarke_to_bending,
    coupled,
    decoupled,
)
from clarke_gym.kinematics.dome import (
    dome_density,
    sample_dome,
    sample_tips,
)
from clarke_gym.kinematics.poses import (
    arc_planes,
    arc_pose,
    backbone,
    chain_points,
    chain_poses,
    forward,
    segment_ends,
    segment_pose,
)
from clarke_gym.kinematics.quaternions import (
    Components,
    quaternion_multiply,
    rotate,
)

__all__ = [
    "Components",
    "arc_planes",
    "arc_pose",
    "backbone",
    "bending_to_clarke",
    "chain_points",
    "chain_poses",
    "clarke_to_bending",
    "coupled",
    "decoupled",
    "dome_density",
    "forward",
    "half_angle_functions",
    "quaternion_multiply",
    "rotate",
    "sample_dome",
    "sample_tips",
    "segment_ends",
    "segment_pose",
]
