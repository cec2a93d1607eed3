"""The protocol that every physics model fulfils, and the state that tasks and sensors read."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray, Number, from_components
from clarke_gym.numerics.batch import Batch
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.robot import Robot
from clarke_gym.robots.scene import Surroundings

DISK_RIM_M = 1e-3
"""How far a disk reaches beyond its outermost tendon hole [m]."""

CLEARANCE_POINTS = 12
"""Points a segment at which `RobotState.clearance` looks."""


def hull_radius(robot: Robot) -> float:
    """Return how far a robot reaches from its backbone: to the rims of its largest disks [m].

    Parameters
    ----------
    robot : Robot

    Returns
    -------
    float

    Examples
    --------
    >>> hull_radius(Robot())
    0.011
    """
    return DISK_RIM_M + max(float(segment.radii.max()) for segment in robot.segments)


class Physics(Protocol):
    """A batch of B equal robots advanced by one control period at a time."""

    KEYWORDS: ClassVar[tuple[str, ...]]
    """Keyword arguments of environments that this model takes."""
    OFFERS: ClassVar[tuple[str, ...]]
    """What its states have beyond those of constant curvature, e.g. "tension"."""

    robot: Robot
    batch: Batch
    surroundings: Surroundings
    displacement_bound: float
    """Largest achieved displacement over the largest commanded one."""

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""

    def rest(self, clarke: FloatArray) -> FloatArray:
        """Return the model's own coordinates (R, k) of robots at rest at `clarke` (R, S, 2)."""

    def reset(
        self, rows: NDArray[np.intp], clarke: FloatArray, rest: FloatArray | None = None
    ) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2).

        Who knows `self.rest(clarke)` already may give it as `rest`.
        """

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements."""

    def place(self, rows: NDArray[np.intp], bodies: FloatArray) -> None:
        """Put the bodies around the robots `rows` to ends and radii (rows, K, 7) [m]."""

    def pull(self, force: FloatArray) -> None:
        """Let forces (B, 3) [N] in the base frame act on the tips from now on."""

    def vary(self, rows: NDArray[np.intp], numbers: Mapping[str, FloatArray]) -> None:
        """Give the robots `rows` physical numbers of their own, by name.

        "payload_kg" (R,); "stiffness" and "damping" of the backbone over the nominal (R,);
        "base_tilt_rad", rotation vectors of the base (R, 3); "tendon_stiffness" and "pretension"
        of each segment's tendons over the nominal (R, S); "intact", whether a tendon is not broken
        (R, N); "turn_rad", what tendons turn round the backbone along a segment (R,); "friction",
        coefficients of friction between tendons and holes (R,).
        """

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""


def _no_goal(steps: int) -> FloatArray:
    """Refuse to look ahead: a state of a physics by itself knows no goals."""
    raise ValueError(f"no environment tells this state where goals are in {steps} steps")


class RobotState:
    """What tasks, sensors and rewards may know of B robots, whichever physics made it.

    Everything is a plain array with a row for each robot, in SI units and in the frame of the base.

    Parameters
    ----------
    physics : Physics
        Whose state it is.
    displacement : JointVector
        Achieved tendon displacements [m].
    tip : components of 3 numbers
        Tip position [m].
    quaternion : components of 4 numbers
        Tip orientation (w, x, y, z).
    diverged : ndarray of bool, shape (B,)
        True where the simulation broke down; the episode ends there.
    """

    def __init__(
        self,
        physics: Physics,
        displacement: JointVector,
        tip: Sequence[Number],
        quaternion: Sequence[Number],
        diverged: NDArray[np.bool_],
    ) -> None:
        self._physics, self._tip, self._quaternion = physics, tip, quaternion
        self.displacement_vector = self.command_vector = displacement
        self.diverged = diverged
        self.goal_after: Callable[[int], FloatArray] = _no_goal
        """Goals (B, size) in SI units in some control periods, where an environment tells them."""
        self._known: dict[str, Any] = {}

    def once(self, name: str, compute: Callable[[RobotState], Any]) -> Any:
        """Return what a function says of this state, computed once and kept under a name."""
        if name not in self._known:
            self._known[name] = compute(self)
        return self._known[name]

    @property
    def robot(self) -> Robot:
        """The robots' description."""
        return self._physics.robot

    @property
    def command(self) -> FloatArray:
        """Displacements that the drives are told to reach [m], shape (B, N)."""
        return self.command_vector.joint(self.robot)

    @property
    def displacement(self) -> FloatArray:
        """Achieved tendon displacements rho [m], shape (B, N)."""
        return self.displacement_vector.joint(self.robot)

    @cached_property
    def tip_position(self) -> FloatArray:
        """Tip position [m], shape (B, 3)."""
        return from_components(self._tip)

    @cached_property
    def tip_quaternion(self) -> FloatArray:
        """Tip orientation (w, x, y, z), shape (B, 4)."""
        return from_components(self._quaternion)

    @cached_property
    def tip_tangent(self) -> FloatArray:
        """The tip's unit z axis, shape (B, 3)."""
        w, x, y, z = self._quaternion
        tangent = (2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y))
        return from_components(tangent)

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3), base first."""
        return self._physics.backbone(points)

    @property
    def clearance(self) -> FloatArray:
        """Smallest gap between the robot and the bodies of its scene [m], shape (B,).

        It is looked at `CLEARANCE_POINTS` points a segment, and so larger than the true gap where
        a body touches between two of them (docs/validation/task_soak.md: by how much).
        """
        return self.once("clearance", RobotState._clearance)

    def _clearance(self) -> FloatArray:
        return self._physics.surroundings.clearance(self.backbone(CLEARANCE_POINTS))

    @property
    def bodies(self) -> FloatArray:
        """Ends of axes and radii of the bodies around each robot [m], shape (B, K, 7)."""
        return self._physics.surroundings.numbers

    @property
    def tension(self) -> FloatArray:
        """Tension of every tendon [N], shape (B, N); "mujoco" alone has it."""
        return self._offered("tension")

    @property
    def velocity(self) -> FloatArray:
        """Rate at which the shape moves every tendon [m/s], shape (B, N)."""
        return self._offered("velocity")

    @property
    def tip_velocity(self) -> FloatArray:
        """Velocity of the tip [m/s], shape (B, 3)."""
        return self._offered("tip_velocity")

    @property
    def contact_force(self) -> FloatArray:
        """Magnitude of the net force between robot and scene [N], (B,); "mujoco" alone has it."""
        return self._offered("contact_force")

    def _offered(self, noun: str) -> FloatArray:
        if noun not in self._physics.OFFERS:
            raise ValueError(f"{type(self._physics).__name__} has no {noun}; physics='mujoco' does")
        found: FloatArray = getattr(self._physics, noun)
        return found
