"""What the simulated body is that the nominal one is not: MuJoCo alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from clarke_gym.disturbances.base import Simulated, register_disturbance
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.noise import directions, uniforms
from clarke_gym.physics.statics import most_payload_kg
from clarke_gym.robots.robot import Robot

MOST_PAYLOAD_KG = 0.01
"""Heaviest payload at the tip."""

MOST_PUSH_N = 0.1
"""Largest force of a push on the tip."""

PUSH_STEPS, REST_STEPS = 4, 12
"""Control periods that a push lasts, and that are left of the window which has one push."""

MOST_TILT_RAD = math.radians(20.0)
"""Largest tilt of the base."""

STIFFER = 0.3
"""Largest difference of the backbone's stiffness from the nominal one, over it."""

LESS_DAMPED = 0.5
"""Largest difference of its damping, likewise."""


@register_disturbance("payload")
class Payload(Simulated):
    """A point mass at the tip, up to 10 g, drawn for every episode."""

    def make(self, robot: Robot) -> Robot:
        """Refuse robots that the heaviest mass would crush."""
        heaviest, most = MOST_PAYLOAD_KG * self.strength, most_payload_kg(robot)
        if heaviest > most:
            raise ValueError(
                f"disturbance 'payload' of up to {heaviest:.3g} kg is more than this robot can be "
                f"simulated under: at most {most:.3g} kg"
            )
        return robot

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return masses [kg]."""
        return {"payload_kg": MOST_PAYLOAD_KG * self.strength * numbers[:, 0]}


@register_disturbance("backbone_stiffness")
class BackboneStiffness(Simulated):
    """The backbone is up to 30 % softer or stiffer, drawn for every episode."""

    strongest: ClassVar[float] = 0.9 / STIFFER

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return factors."""
        return {"stiffness": 1.0 + STIFFER * self.strength * (2.0 * numbers[:, 0] - 1.0)}


@register_disturbance("damping")
class Damping(Simulated):
    """The backbone is damped up to 50 % less or more, drawn for every episode."""

    strongest: ClassVar[float] = 1.0 / LESS_DAMPED

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return factors."""
        return {"damping": 1.0 + LESS_DAMPED * self.strength * (2.0 * numbers[:, 0] - 1.0)}


@register_disturbance("base_tilt")
class BaseTilt(Simulated):
    """The base is mounted up to 20 degrees off, in a direction drawn for every episode."""

    strongest: ClassVar[float] = 9.0  # upside down
    numbers: ClassVar[int] = 2
    hidden: ClassVar[int] = 2

    def vary(self, numbers: FloatArray) -> Mapping[str, FloatArray]:
        """Return rotation vectors [rad] of the base, (R, 3)."""
        tilt = MOST_TILT_RAD * self.strength * numbers[:, :1]
        angle = 2.0 * np.pi * numbers[:, 1:]
        turn = np.concatenate([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
        return {"base_tilt_rad": tilt * turn}


@register_disturbance("push")
class Push(Simulated):
    """Pushes on the tip, up to 0.1 N in any direction: one of 4 steps somewhere in every 16."""

    hidden: ClassVar[int] = 0

    def force(self) -> FloatArray:
        """Return the forces [N]."""
        u = uniforms(self.drawn[:, 0], self.steps // (PUSH_STEPS + REST_STEPS), 4)
        begin = np.floor(u[:, 3] * (REST_STEPS + 1))
        since = self.steps % (PUSH_STEPS + REST_STEPS) - begin
        pushing = (since >= 0) & (since < PUSH_STEPS)
        force: FloatArray = (MOST_PUSH_N * self.strength * u[:, 0] * pushing)[:, None] * directions(
            u[:, 1:3]
        )
        return force
