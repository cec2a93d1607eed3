"""Constant-curvature physics: taut tendons, quasi-static shape, first-order drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clarke_gym import kinematics
from clarke_gym.kinematics.jacobians import tip_jacobian
from clarke_gym.numerics.arrays import FloatArray, Number
from clarke_gym.numerics.batch import Batch, as_batch
from clarke_gym.numerics.linear_map import map_rows
from clarke_gym.physics.base import RobotState, hull_radius
from clarke_gym.physics.drives import Drives
from clarke_gym.robots import Robot
from clarke_gym.robots.joint_vector import JointVector
from clarke_gym.robots.scene import EMPTY, Scene, Surroundings

Poses: TypeAlias = Sequence[tuple[kinematics.Components, kinematics.Components]]
"""Position and orientation of each segment's end."""


class ConstantCurvature:
    r"""A batch of robots whose segments are circular arcs.

    All tendons are taut, so the shape follows :math:`P\rho` alone and the off-manifold part only
    raises internal tension. The drives follow their command with the time constant tau; one
    control period of length T closes the gap by the exact factor :math:`1 - e^{-T/\tau}`.

    Parameters
    ----------
    robot : Robot
    batch : Batch or int
        One robot or many; a number stands for that many.
    control_dt : float
        Control period T [s].
    scene : Scene, optional
        Bodies around the robot. Nothing bends the shape here: they tell by clearance alone.

    Examples
    --------
    >>> physics = ConstantCurvature(Robot(), 1, 0.05)
    >>> physics.reset(np.array([0]), np.zeros((1, 1, 2)))
    >>> physics.step(JointVector.from_clarke(np.array([[[0.001, 0.0]]])))
    >>> float(physics.state.displacement_vector.clarke[0, 0, 0].round(6))  # 1 - 1/e of the command
    0.000632
    """

    KEYWORDS: ClassVar[tuple[str, ...]] = ()
    OFFERS: ClassVar[tuple[str, ...]] = ("velocity", "tip_velocity")

    displacement_bound = 1.0

    def __init__(
        self, robot: Robot, batch: Batch | int, control_dt: float, scene: Scene = EMPTY
    ) -> None:
        self.robot, self.batch = robot, as_batch(batch)
        self.surroundings = Surroundings(scene, self.batch.size, hull_radius(robot))
        self._drives = Drives(robot, control_dt)
        self._lengths = robot.lengths.tolist()
        self._radii = robot.pitch_radii.tolist()
        self._control_dt = control_dt
        self._displacement = JointVector(self.batch.zeros(2 * robot.n_segments))
        self._before = self._displacement
        self._never = np.zeros(self.batch.size, dtype=bool)
        self._state: RobotState | None = None
        self._known: tuple[JointVector, Sequence[Number], Poses] | None = None

    @property
    def state(self) -> RobotState:
        """The current state of all robots."""
        if self._state is None:
            tip = self._chain()[1][-1]
            self._state = RobotState(self, self._displacement, *tip, self._never)
        return self._state

    def _chain(self) -> tuple[Sequence[Number], Poses]:
        """Return the segments' bends and the poses of their ends, computed once a shape."""
        if self._known is None or self._known[0] is not self._displacement:
            bends = kinematics.decoupled(self._displacement.parts, self._radii)
            poses = kinematics.chain_poses(bends, self._lengths)
            self._known = self._displacement, bends, poses
        return self._known[1:]

    def rest(self, clarke: FloatArray) -> FloatArray:
        """Return no coordinates beside the Clarke coordinates: shape (R, 0)."""
        return np.empty((len(clarke), 0))

    def reset(
        self, rows: NDArray[np.intp], clarke: FloatArray, rest: FloatArray | None = None
    ) -> None:
        """Put the robots `rows` at rest at the Clarke coordinates `clarke` (rows, S, 2)."""
        del rest
        self._displacement = self._displacement.with_rows(self.batch, rows, clarke)
        self._before = self._before.with_rows(self.batch, rows, clarke)
        self._state = None

    def step(self, command: JointVector) -> None:
        """Advance all robots by one control period under the commanded displacements."""
        self._before = self._displacement
        self._displacement = self._drives.approach(self._displacement, command)
        self._state = None

    def place(self, rows: NDArray[np.intp], bodies: FloatArray) -> None:
        """Put the bodies around the robots `rows` to ends and radii (rows, K, 7) [m]."""
        self.surroundings.place(rows, bodies)
        self._state = None

    def pull(self, force: FloatArray) -> None:
        """Refuse forces: nothing bends a shape here but its tendons."""
        del force
        raise ValueError("constant curvature feels no forces; physics='mujoco' does")

    def vary(self, rows: NDArray[np.intp], numbers: Mapping[str, FloatArray]) -> None:
        """Refuse physical numbers: an arc has none."""
        del rows
        raise ValueError(f"constant curvature has no {list(numbers)}; physics='mujoco' does")

    @property
    def velocity(self) -> FloatArray:
        """Mean rate at which the shape moved every tendon in the last control period, (B, N).

        In m/s. What is off the manifold strains tendons and moves no shape.
        """
        return map_rows(self._rates().reshape(self.batch.size, -1), self.robot.decoder.T)

    @property
    def tip_velocity(self) -> FloatArray:
        """Velocity of the tip at those rates [m/s], shape (B, 3)."""
        radii = self.robot.pitch_radii
        bending = kinematics.clarke_to_bending(self._displacement.clarke, radii)
        rates = kinematics.clarke_to_bending(self._rates(), radii).reshape(self.batch.size, -1)
        velocity: FloatArray = np.matvec(tip_jacobian(bending, self.robot.lengths)[:, :3], rates)
        return velocity

    def _rates(self) -> FloatArray:
        """Return the mean rates of the Clarke coordinates [m/s], shape (B, S, 2)."""
        rates: FloatArray = (self._displacement.clarke - self._before.clarke) / self._control_dt
        return rates

    def backbone(self, points: int) -> FloatArray:
        """Return points along the backbones [m], shape (B, S * points + 1, 3)."""
        planes = np.array(kinematics.arc_planes(*self._chain(), self._lengths))
        fractions = np.arange(1, points + 1) / points
        curve: FloatArray = kinematics.chain_points(planes.reshape(-1, self.batch.size), fractions)
        return curve

    def get_state(self) -> dict[str, Any]:
        """Return a copy of everything that the next step depends on."""
        return {"now": self._displacement.get_state(), "before": self._before.get_state()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to a state of `get_state`, bit for bit."""
        self._displacement = JointVector.from_state(self.batch, state["now"])
        self._before = JointVector.from_state(self.batch, state["before"])
        self._state = None
