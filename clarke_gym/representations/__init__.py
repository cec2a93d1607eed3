"""Pairs of pure maps between a policy's numbers and joint space."""

from clarke_gym.representations.registry import (
    Representation,
    make_representation,
    representation_names,
)

__all__ = [
    "Representation",
    "make_representation",
    "representation_names",
]
