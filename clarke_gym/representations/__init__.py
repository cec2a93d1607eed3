"""Pairs of pure maps between a policy's numbers and joint space."""

from clarke_gym.representations.registry import (
    REPRESENTATIONS,
    Representation,
    clarke_layout,
    make_representation,
    register_representation,
    representation_names,
)

__all__ = [
    "REPRESENTATIONS",
    "Representation",
    "clarke_layout",
    "make_representation",
    "register_representation",
    "representation_names",
]
