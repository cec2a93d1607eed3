"""The keyword arguments of every environment: one place for names, defaults and checks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from clarke_gym.numerics.checks import check_choice, check_count, check_positive
from clarke_gym.robots.presets import make_robot
from clarke_gym.robots.robot import Robot

CONTROLS = ("increment", "absolute")
PHYSICS = ("constant_curvature", "mujoco")
TASKS = ("reach",)


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """What an environment is built from. All values are names and numbers, so specs are JSON-able.

    Parameters
    ----------
    task : str
        "reach".
    robot : str
        A name of `clarke_gym.robots.presets.PRESETS`, e.g. "default", "two_segment", "hardware".
    n_tendons : int, optional
        Tendons of every segment, at least 3 (default: the preset's).
    n_segments : int, optional
        Number of equal segments (default: the preset's). They share the length that the backbone
        holds up, see `clarke_gym.robots.presets.make_robot`, unless `segment_length_m` is given.
    segment_length_m, pitch_radius_m, max_bending_rad : float, optional
        Dimensions of every segment (default: the preset's).
    material : str, optional
        Backbone material, a name of `clarke_gym.robots.MATERIALS` (default: the preset's).
    physics : str
        "constant_curvature" (taut tendons: off-manifold commands change nothing in the shape) or
        "mujoco" (real tendons: off-manifold commands raise tension and can slacken tendons).
    profile : str
        MuJoCo only: "fast" (for learning) or "accurate" (finer elements and time step).
    sim_dt_s : float, optional
        MuJoCo only: time step [s]; must divide `control_dt`. The profile's by default.
    payload_kg : float
        MuJoCo only: point mass at the tip [kg].
    threads : int, optional
        MuJoCo only: threads to step on; all cores, at most one an environment, by default.
    control : str
        "increment" (an action of 1 moves a tendon at its speed limit) or "absolute" (an action
        of 1 asks for the largest displacement).
    control_dt : float
        Control period [s].
    reward : str
        "dense" (in [0, 1]) or "sparse" (0 on success, -1 otherwise).
    success_tolerance : float
        Tip error that counts as success, as a fraction of the robot's length.
    random_start : bool
        Start from a random shape; straight otherwise.
    goal_env : bool
        Observe a dictionary of ``observation``, ``achieved_goal`` and ``desired_goal``.
    render_width, render_height : int
        Size of a picture in pixels.

    Raises
    ------
    ValueError, TypeError
        If a value is impossible; the message names it and what is allowed.

    Examples
    --------
    >>> EnvConfig(n_tendons=7).make_robot().n_joints
    7
    """

    task: str = "reach"
    robot: str = "default"
    n_tendons: int | None = None
    n_segments: int | None = None
    segment_length_m: float | None = None
    pitch_radius_m: float | None = None
    max_bending_rad: float | None = None
    material: str | None = None
    physics: str = "constant_curvature"
    profile: str = "fast"
    sim_dt_s: float | None = None
    payload_kg: float = 0.0
    threads: int | None = None
    control: str = "increment"
    control_dt: float = 0.05
    reward: str = "dense"
    success_tolerance: float = 0.02
    random_start: bool = True
    goal_env: bool = False
    render_width: int = 480
    render_height: int = 480

    def __post_init__(self) -> None:
        check_choice("task", self.task, TASKS)
        check_choice("physics", self.physics, PHYSICS)
        check_choice("control", self.control, CONTROLS)
        if self.physics != "mujoco":
            for name in MUJOCO_ONLY:
                if getattr(self, name) != MUJOCO_ONLY[name]:
                    raise ValueError(
                        f"{name} needs physics='mujoco', got {name}={getattr(self, name)!r} with "
                        f"physics={self.physics!r}"
                    )
        check_positive("control_dt", self.control_dt)
        for name in ("render_width", "render_height"):
            check_count(name, getattr(self, name), 16, 4096)
        for name in ("random_start", "goal_env"):
            if not isinstance(getattr(self, name), bool):
                raise TypeError(f"{name} must be true or false, got {getattr(self, name)!r}")

    @property
    def render_fps(self) -> int:
        """Frames a second at which a recording runs in real time."""
        return max(1, math.floor(1.0 / self.control_dt + 0.5))

    def make_robot(self) -> Robot:
        """Return the robot that these numbers describe."""
        return make_robot(
            self.robot,
            n_tendons=self.n_tendons,
            n_segments=self.n_segments,
            segment_length_m=self.segment_length_m,
            pitch_radius_m=self.pitch_radius_m,
            max_bending_rad=self.max_bending_rad,
            material=self.material,
        )


MUJOCO_ONLY = {
    name: EnvConfig.__dataclass_fields__[name].default
    for name in ("profile", "sim_dt_s", "payload_kg", "threads")
}
"""Keywords that constant-curvature physics does not have, and the defaults they keep there."""
