"""What is known of the tendons."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.physics.base import RobotState
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.sensors.base import BOUND_MARGIN, JointSensor, register_sensor

MOST_TENSION = 4.0
"""Largest tension that is seen, over the pretension."""

MOST_SPEED = 4.0
"""Largest speed that is seen, over the drives' speed limit."""


@register_sensor("command")
class Command(JointSensor):
    """Displacements that the drives are told to reach."""

    measured: ClassVar[bool] = False
    unit: ClassVar[str] = "m"

    def read(self, state: RobotState) -> FloatArray:
        """Return commands [m]."""
        return state.command

    @property
    def passes(self) -> bool:
        """Where displacements can swing beyond their commands."""
        return self.plant.physics.displacement_bound > 1.0

    def vector(self, state: RobotState, splitter: Splitter) -> JointVector:
        """Return commands [m], which are split already."""
        del splitter
        return state.command_vector


@register_sensor("displacement")
class Displacement(JointSensor):
    """Achieved displacements of the tendons."""

    unit: ClassVar[str] = "m"

    def read(self, state: RobotState) -> FloatArray:
        """Return displacements [m]."""
        return state.displacement

    @property
    def passes(self) -> bool:
        """Where displacements can swing beyond their commands, or drives are told other ones."""
        disturbed = any(each.overrides("step") for each in self.plant.disturbances)
        return disturbed or self.plant.physics.displacement_bound > 1.0

    def vector(self, state: RobotState, splitter: Splitter) -> JointVector:
        """Return displacements [m], which are split already."""
        del splitter
        return state.displacement_vector


@register_sensor("velocity")
class Velocity(JointSensor):
    """Rates at which the shape moves the tendons."""

    unit: ClassVar[str] = "m/s"
    needs: ClassVar[tuple[str, ...]] = ("velocity",)

    @property
    def scale(self) -> FloatArray:
        """The drives' speed limits [m/s]."""
        return self.plant.robot.tendon_speeds

    @property
    def bound(self) -> tuple[float, FloatArray]:
        """Some times the speed limit: shapes swing."""
        most = BOUND_MARGIN * MOST_SPEED
        return most, np.zeros(self.plant.robot.n_joints)

    def read(self, state: RobotState) -> FloatArray:
        """Return rates [m/s]."""
        return state.velocity


@register_sensor("tension")
class Tension(JointSensor):
    """Tensions of the tendons."""

    unit: ClassVar[str] = "N"
    needs: ClassVar[tuple[str, ...]] = ("tension",)

    @property
    def scale(self) -> FloatArray:
        """The pretension of each segment's tendons [N], 1 N where there is none."""
        return np.array([s.pretension_n or 1.0 for s in self.plant.robot.segments])

    @property
    def bound(self) -> tuple[float, FloatArray]:
        """Some times the pretension."""
        most = BOUND_MARGIN * MOST_TENSION
        return most, np.full(self.plant.robot.n_joints, most)

    def read(self, state: RobotState) -> FloatArray:
        """Return tensions [N]."""
        return state.tension
