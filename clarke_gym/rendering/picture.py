"""One picture for every physics: backbone, disks, tendons coloured by load, and the goal.

The scene is drawn from points of the backbone, so constant curvature and MuJoCo look alike. It
needs no window: EGL or OSMesa draw off-screen.
"""

from __future__ import annotations

import itertools
import math
import os
import weakref
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.rendering.room import camera_distance, make_context, make_model, room
from clarke_gym.rendering.thread import DrawingThread, drawing_thread
from clarke_gym.robots.robot import Robot
from clarke_gym.robots.scene import EMPTY, Scene

Image = NDArray[np.uint8]

BACKBONE = (0.25, 0.27, 0.30, 1.0)
DISK = (0.72, 0.75, 0.80, 1.0)
BODY = (0.55, 0.60, 0.45, 1.0)
GOAL = (0.90, 0.35, 0.05, 1.0)
REACHED = (0.10, 0.65, 0.30, 1.0)
FORCE = (0.55, 0.20, 0.65, 1.0)
SHADOW = (0.45, 0.48, 0.52, 1.0)
SLACK = np.array([0.16, 0.42, 0.88, 1.0])
AT_REST = np.array([0.62, 0.63, 0.66, 1.0])
TAUT = np.array([0.85, 0.10, 0.15, 1.0])
UP = np.array([0.0, 0.0, 1.0])

FULL_FORCE_N = 0.2
"""Force whose arrow is a quarter of the robot long."""

_ARROW = mujoco.mjtGeom.mjGEOM_ARROW
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER
_CAPSULE = mujoco.mjtGeom.mjGEOM_CAPSULE
_SPHERE = mujoco.mjtGeom.mjGEOM_SPHERE


def _most_shapes(robot: Robot) -> int:
    """Return how many shapes a picture can need: disks, backbone, shadow, tendons from the base."""
    points = max(segment.n_disks for segment in robot.segments)
    tendons = sum(n * (s + 1) for s, n in enumerate(robot.n_tendons))
    return 200 + points * (3 * robot.n_segments + tendons)


def load_colour(load: float) -> FloatArray:
    """Return the colour of a tendon: blue is slack, grey rests, red is pulled hard.

    Parameters
    ----------
    load : float
        0 for none, 1/2 at rest, 1 and above for the most.

    Returns
    -------
    ndarray, shape (4,)
        Red, green, blue and opacity.

    Examples
    --------
    >>> load_colour(0.5), load_colour(0.0)
    (array([0.62, 0.63, 0.66, 1.  ]), array([0.16, 0.42, 0.88, 1.  ]))
    """
    pull = 2.0 * min(max(load, 0.0), 1.0) - 1.0
    # The root lets small differences show: tensions of a bent arm differ by a fifth.
    share = math.sqrt(abs(pull))
    colour: FloatArray = AT_REST + share * ((TAUT if pull > 0.0 else SLACK) - AT_REST)
    return colour


def transported_frames(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the x and y axes of the torsion-free frame along a curve.

    Parameters
    ----------
    points : ndarray, shape (P, 3)
        Points of the backbone; the frame at the first one is the base frame.

    Returns
    -------
    x, y : ndarray, shape (P, 3)

    Examples
    --------
    >>> x, y = transported_frames(np.array([[0.0, 0, 0], [0, 0, 1], [0, 0, 2]]))
    >>> x[-1], y[-1]
    (array([1., 0., 0.]), array([0., 1., 0.]))
    """
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    inner = steps[1:] + steps[:-1]
    tangents = np.vstack(
        [[0.0, 0.0, 1.0], inner / np.linalg.norm(inner, axis=1)[:, None], steps[-1]]
    )
    x = np.empty_like(points)
    x[0] = 1.0, 0.0, 0.0
    for k in range(1, len(points)):  # each frame is the last one turned by the least rotation
        bisector = tangents[k - 1] + tangents[k]
        turned = x[k - 1] - 2.0 * (x[k - 1] @ bisector) / (bisector @ bisector) * bisector
        x[k] = turned - 2.0 * (turned @ tangents[k]) * tangents[k]
    return x, np.cross(tangents, x)


class Picture:
    """An off-screen camera on one robot.

    Parameters
    ----------
    robot : Robot
    width, height : int
        Size of the image in pixels.
    scene : Scene
        Bodies around the robot.

    Raises
    ------
    RuntimeError
        If the machine has no off-screen OpenGL; the message names what to install.
    """

    def __init__(
        self, robot: Robot, width: int = 480, height: int = 480, scene: Scene = EMPTY
    ) -> None:
        self._robot, self._bodies = robot, scene.numbers
        # A context belongs to a thread; in the caller's, that of a window may be current.
        self._thread, self._process = drawing_thread(), os.getpid()
        context, render = self._thread.ask(self._make, width, height)
        # A picture that nobody closes is freed when it is forgotten.
        self._end = weakref.finalize(self, _leave, self._thread, context, render)
        self._end.atexit = False

    def _make(self, width: int, height: int) -> tuple[Any, Any]:
        length = self._robot.length_m
        self._floor, reach = room(self._robot)
        self._context = make_context(width, height)
        self._model = make_model(width, height, length, self._floor)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._scene = mujoco.MjvScene(
            self._model, maxgeom=_most_shapes(self._robot) + len(self._bodies)
        )
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        self._render = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._render)
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._camera = mujoco.MjvCamera()
        self._camera.lookat[:] = 0.0, 0.0, 0.5 * (length + self._floor)
        self._camera.distance = camera_distance(length - self._floor, reach, width / height)
        self._camera.azimuth, self._camera.elevation = 130.0, -14.0
        return self._context, self._render

    def draw(
        self,
        backbone: FloatArray,
        points: int,
        load: FloatArray,
        goal: Sequence[float] | FloatArray | None = None,
        success: bool = False,
        bodies: FloatArray | None = None,
        path: FloatArray | None = None,
        force: FloatArray | None = None,
    ) -> tuple[Image, NDArray[np.float32]]:
        """Return the picture and its depth.

        Parameters
        ----------
        backbone : ndarray, shape (S * points + 1, 3)
            Points along the backbone [m], base first.
        points : int
            Points a segment; a disk is drawn at each.
        load : ndarray, shape (N,)
            Load of each tendon: 0 (blue, slack), 1/2 (grey, at rest) to 1 (red).
        goal : array_like, shape (3,), (6,) or (K, 3), optional
            Goal position [m], with a direction after it, or some positions.
        success : bool
            Draw the goal in green.
        bodies : ndarray, shape (K, 7), optional
            Ends of the axes and radii of the bodies [m], where they are not as in the scene.
        path : ndarray, shape (K, 3), optional
            Places that the goal will come to [m].
        force : ndarray, shape (3,), optional
            What pushes the tip [N], drawn as an arrow that ends there.

        Returns
        -------
        rgb : ndarray of uint8, shape (height, width, 3)
        depth : ndarray of float32, shape (height, width)
            Distance from the camera plane [m].

        Raises
        ------
        RuntimeError
            In a process forked from the one that made this object.
        """
        if os.getpid() != self._process:
            raise RuntimeError(
                "pictures do not survive a fork; make the environment in the process that draws"
            )
        result: tuple[Image, NDArray[np.float32]] = self._thread.ask(
            self._draw, backbone, points, load, goal, success, bodies, path, force
        )
        return result

    def _draw(
        self,
        backbone: FloatArray,
        points: int,
        load: FloatArray,
        goal: Sequence[float] | FloatArray | None,
        success: bool,
        bodies: FloatArray | None,
        path: FloatArray | None,
        force: FloatArray | None,
    ) -> tuple[Image, NDArray[np.float32]]:
        self._context.make_current()
        mujoco.mjv_updateScene(
            self._model,
            self._data,
            mujoco.MjvOption(),
            None,
            self._camera,
            mujoco.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        self._draw_robot(backbone, points, load)
        for *axis, radius in self._bodies if bodies is None else bodies:
            start, end = np.array(axis[:3]), np.array(axis[3:])
            if (start == end).all():
                self._sphere(start, radius, BODY)
            else:
                self._link(_CAPSULE, radius, start, end, BODY)
        if goal is not None:
            self._draw_goal(np.asarray(goal, np.float64), REACHED if success else GOAL)
        for place in () if path is None else path:
            self._sphere(place, 0.008 * self._robot.length_m, GOAL)
        if force is not None and np.linalg.norm(force) > 0.0:
            size = 0.25 * self._robot.length_m / FULL_FORCE_N
            self._link(
                _ARROW,
                0.015 * self._robot.length_m,
                backbone[-1] - size * force,
                backbone[-1],
                FORCE,
            )
        mujoco.mjr_render(self._rect, self._scene, self._render)
        rgb = np.empty((self._rect.height, self._rect.width, 3), np.uint8)
        depth = np.empty((self._rect.height, self._rect.width), np.float32)
        mujoco.mjr_readPixels(rgb, depth, self._rect, self._render)
        return rgb[::-1].copy(), self._metres(depth[::-1])

    def close(self) -> None:
        """Free the OpenGL context; a second call does nothing."""
        self._end()

    def _metres(self, buffer: NDArray[np.float32]) -> NDArray[np.float32]:
        extent = self._model.stat.extent
        near, far = (extent * v for v in (self._model.vis.map.znear, self._model.vis.map.zfar))
        return np.asarray(near / (1.0 - buffer * (1.0 - near / far)), np.float32)

    def _draw_goal(self, goal: FloatArray, colour: Any) -> None:
        """Draw positions with lines down to the floor, so that one sees how far away they are."""
        length = self._robot.length_m
        if goal.shape == (6,):
            self._link(
                _ARROW, 0.012 * length, goal[:3], goal[:3] + 0.18 * length * goal[3:], colour
            )
            goal = goal[:3]
        for place in np.atleast_2d(goal):
            self._sphere(place, 0.025 * length, colour)
            below = np.array([*place[:2], self._floor])
            self._link(_CAPSULE, 0.002 * length, place, below, colour)
            above = below + 0.002 * length * UP
            self._link(_CYLINDER, 0.025 * length, below, above, SHADOW)

    def _draw_robot(self, curve: FloatArray, points: int, load: FloatArray) -> None:
        x, y = transported_frames(curve)
        normal = np.cross(x, y)
        base = np.array([0.0, 0.0, self._floor])
        radius = 1.6 * float(self._robot.pitch_radii.max())
        self._link(_CYLINDER, radius, base, np.zeros(3), DISK)
        shadow = curve.copy()
        shadow[:, 2] = self._floor
        for a, b in itertools.pairwise(shadow):
            self._link(_CAPSULE, 0.004 * self._robot.length_m, a, b, SHADOW)
        tendon = 0
        for s, segment in enumerate(self._robot.segments):
            thickness = 0.16 * segment.length_m / points
            cable = min(0.0035 * self._robot.length_m, 0.07 * segment.pitch_radius_m)
            width = max(0.5 * segment.backbone_diameter_m, 0.004 * self._robot.length_m)
            rim = 1.12 * float(segment.radii.max())
            for k in range(s * points, (s + 1) * points):
                self._link(_CAPSULE, width, curve[k], curve[k + 1], BACKBONE)
                half = 0.5 * thickness * normal[k + 1]
                self._link(_CYLINDER, rim, curve[k + 1] - half, curve[k + 1] + half, DISK)
            # Tendons run along the whole robot up to the end of their segment.
            for angle, distance in zip(segment.angles, segment.radii, strict=True):
                stop = (s + 1) * points + 1
                path = curve[:stop] + distance * (
                    np.cos(angle) * x[:stop] + np.sin(angle) * y[:stop]
                )
                colour = load_colour(float(load[tendon]))
                for a, b in itertools.pairwise(path):
                    self._link(_CAPSULE, cable, a, b, colour)
                tendon += 1

    def _next(self) -> Any:
        geom = self._scene.geoms[self._scene.ngeom]
        self._scene.ngeom += 1
        return geom

    def _link(self, kind: Any, width: float, a: FloatArray, b: FloatArray, rgba: Any) -> None:
        geom = self._next()
        colour = np.asarray(rgba, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.zeros(9), colour)
        mujoco.mjv_connector(geom, kind, width, a, b)

    def _sphere(self, centre: Sequence[float] | FloatArray, radius: float, rgba: Any) -> None:
        mujoco.mjv_initGeom(
            self._next(),
            _SPHERE,
            np.full(3, radius),
            np.asarray(centre, np.float64),
            np.eye(3).ravel(),
            np.asarray(rgba, np.float32),
        )


def _leave(thread: DrawingThread, context: Any, render: Any) -> None:
    """Let the drawing thread free what a picture held."""
    if thread.process == os.getpid():
        thread.tell(_free, context, render)


def _free(context: Any, render: Any) -> None:
    context.make_current()
    render.free()
    context.free()
