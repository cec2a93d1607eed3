"""Pictures of robots, without a window."""

from clarke_gym.rendering.picture import (
    Picture,
)

__all__ = [
    "Picture",
]
