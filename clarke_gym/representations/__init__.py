"""Pairs of pure maps between a policy's numbers and joint space."""

from clarke_gym.representations.registry import (
    REPRESENTATIONS,
    Representation,
    make_representation,
    register_representation,
    representation_names,
)

__all__ = [
    "REPRESENTATIONS",
    "Representation",
    "make_representation",
    "register_representation",
    "representation_names",
]
