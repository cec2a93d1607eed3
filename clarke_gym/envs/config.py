"""The keyword arguments of every environment, sorted to the parts that own them."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from clarke_gym.disturbances import parse
from clarke_gym.numerics.checks import check_choice, check_count, check_positive
from clarke_gym.numerics.registry import nearest
from clarke_gym.physics import PHYSICS, loadable, physics_class
from clarke_gym.robots import Robot, make_robot
from clarke_gym.sensors import LADDER, ORACLE, SENSORS
from clarke_gym.tasks import TASKS, Task

CONTROLS = ("increment", "absolute")


def keywords_of(function: Any) -> tuple[str, ...]:
    """Return the names of the keyword-only arguments of a function or class.

    Parameters
    ----------
    function : callable

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> keywords_of(TASKS["reach"])
    ('reward', 'success_tolerance', 'difficulty', 'random_start')
    """
    parameters = inspect.signature(function).parameters.values()
    return tuple(p.name for p in parameters if p.kind is p.KEYWORD_ONLY)


def names_in(text: str | None) -> tuple[str, ...]:
    """Return the names in a combination.

    Parameters
    ----------
    text : str or None
        Names with "+" between them; "none", "" and None stand for no name.

    Returns
    -------
    tuple of str

    Examples
    --------
    >>> names_in("tendons + tip"), names_in("none")
    (('tendons', 'tip'), ())
    """
    if text is not None and not isinstance(text, str):
        raise TypeError(f"names must be a text such as 'tendons+tip', got {text!r}")
    names = tuple(name.strip() for name in (text or "").split("+"))
    return () if names in (("",), ("none",)) else names


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """What an environment is composed of. All values are names and numbers, so specs are JSON-able.

    Parameters
    ----------
    task : str
        A name of `clarke_gym.tasks.TASKS`.
    robot : str, dict or Robot
        A preset's name, e.g. "default", "two_segment", "hardware", or one of `register_robot`; the
        path of a YAML file; or what such a file holds.
    physics : str
        "constant_curvature" (taut tendons: off-manifold commands change nothing in the shape) or
        "mujoco" (real tendons: off-manifold commands raise tension and can slacken tendons).
    sensors : str, optional
        What policies see: names of `clarke_gym.sensors.SENSORS` with "+" between them, e.g.
        "command+tendons+tip", or "oracle" for all that there is; what the task suggests by default.
        The goal is always seen.
    disturbances : str, optional
        Names of `clarke_gym.disturbances.DISTURBANCES` with "+" between them, with a strength where
        it is not 1 ("payload=0.5+push"), or "none", "mild", "hardware", "harsh"; none by default.
    representation : str
        Of actions and observations alike: a name of `clarke_gym.representations`.
    action_representation, observation_representation : str, optional
        One side only; `representation` where it is not given.
    control : str
        "increment" (an action of 1 moves a tendon at its speed limit) or "absolute" (an action
        of 1 asks for the largest displacement).
    control_dt : float
        Control period [s].
    episode_steps : int, optional
        Control periods after which an episode is truncated; the task's by default.
    goal_env : bool
        Observe a dictionary of ``observation``, ``achieved_goal`` and ``desired_goal``.
    render_width, render_height : int
        Size of a picture in pixels.
    robot_options : dict
        Keyword arguments of `clarke_gym.robots.make_robot`.
    task_options : dict
        Keyword arguments of the task.
    physics_options : dict
        Keyword arguments of the physics.

    Raises
    ------
    ValueError, TypeError
        If a value is impossible; the message names it and what is allowed.

    Examples
    --------
    >>> EnvConfig.from_keywords(n_tendons=7).make_robot().n_joints
    7
    """

    task: str = "reach"
    robot: str | dict[str, Any] | Robot = "default"
    physics: str = "constant_curvature"
    sensors: str | None = None
    disturbances: str | None = None
    representation: str = "raw"
    action_representation: str | None = None
    observation_representation: str | None = None
    control: str = "increment"
    control_dt: float = 0.05
    episode_steps: int | None = None
    goal_env: bool = False
    render_width: int = 480
    render_height: int = 480
    robot_options: dict[str, Any] = field(default_factory=dict)
    task_options: dict[str, Any] = field(default_factory=dict)
    physics_options: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _ = TASKS[self.task], PHYSICS[self.physics]
        for name in self.sensor_names or ():
            _ = None if name == ORACLE else SENSORS[name]
        parse(self.disturbances, self.physics)
        check_choice("control", self.control, CONTROLS)
        check_positive("control_dt", self.control_dt)
        if self.episode_steps is not None:
            check_count("episode_steps", self.episode_steps)
        for name in ("render_width", "render_height"):
            check_count(name, getattr(self, name), 16, 4096)
        if not isinstance(self.goal_env, bool):
            raise TypeError(f"goal_env must be true or false, got {self.goal_env!r}")
        if isinstance(self.robot, str) and self.robot.endswith((".yaml", ".yml")):
            # Copies and pickles find the file from another working directory, too.
            object.__setattr__(self, "robot", str(Path(self.robot).absolute()))

    @classmethod
    def from_keywords(cls, **keywords: Any) -> EnvConfig:
        """Return the configuration that keyword arguments of an environment describe.

        Parameters
        ----------
        **keywords
            Fields of this class, and the keyword arguments of the robot, the task and the physics.

        Returns
        -------
        EnvConfig

        Raises
        ------
        TypeError
            If a keyword belongs to none of them; the message has the nearest name and its owner.
        ValueError
            If a keyword belongs to another task or physics.
        """
        options = ("robot_options", "task_options", "physics_options")
        own = {f.name: keywords.pop(f.name) for f in fields(cls) if f.name in keywords}
        task, physics = own.get("task", cls.task), own.get("physics", cls.physics)
        owners = (
            (options[0], keywords_of(make_robot)),
            (options[1], keywords_of(TASKS[task])),
            (options[2], physics_class(physics).KEYWORDS),
        )
        _refuse_shared(task, physics, [known for _, known in owners])
        for name, known in owners:
            found = {key: keywords.pop(key) for key in known if key in keywords}
            own[name] = {**own.get(name, {}), **found}
        if keywords:
            _refuse(next(iter(keywords)), keywords, task, physics)
        return cls(**own)

    @property
    def of_actions(self) -> str:
        """The representation of actions."""
        return self.action_representation or self.representation

    @property
    def of_observations(self) -> str:
        """The representation of observations."""
        return self.observation_representation or self.representation

    @property
    def sensor_names(self) -> tuple[str, ...] | None:
        """Names of the sensors that are asked for; None for those that the task suggests."""
        if self.sensors is None:
            return None
        offers, found = physics_class(self.physics).OFFERS, []
        for name in names_in(self.sensors):
            # A rung is what the physics has of it; a sensor by its own name must be there.
            rung = [one for one in LADDER.get(name, ()) if set(SENSORS[one].needs) <= set(offers)]
            found += rung or [name]
        return tuple(dict.fromkeys(found))

    @property
    def render_fps(self) -> int:
        """Frames a second at which a recording runs in real time."""
        return max(1, math.floor(1.0 / self.control_dt + 0.5))

    @property
    def longest_episode(self) -> int:
        """Steps after which an episode is truncated."""
        return self.episode_steps or TASKS[self.task].max_episode_steps

    def make_robot(self) -> Robot:
        """Return the robot that these numbers describe."""
        return make_robot(self.robot, **self.robot_options)

    def make_task(self, robot: Robot) -> Task:
        """Return the task for a robot."""
        return TASKS[self.task](robot, **self.task_options)


def all_keywords() -> Iterator[tuple[str, str]]:
    """Yield every keyword argument of environments, and which part owns it.

    Returns
    -------
    iterator of (keyword, owner)

    Examples
    --------
    >>> ("n_tendons", "the robot") in list(all_keywords())
    True
    """
    for entry in fields(EnvConfig):
        if not entry.name.endswith("_options"):
            yield entry.name, "every environment"
    for key in keywords_of(make_robot):
        yield key, "the robot"
    for name in TASKS.names():
        for key in keywords_of(TASKS[name]):
            yield key, f"task={name!r}"
    for name, model in loadable():
        for key in model.KEYWORDS:
            yield key, f"physics={name!r}"


def _refuse_shared(task: str, physics: str, known: list[tuple[str, ...]]) -> None:
    """Refuse parts that want the same keyword: one of them would never get it."""
    names = [f"task={task!r}", f"physics={physics!r}"]
    taken = {entry.name: "every environment" for entry in fields(EnvConfig)}
    taken |= dict.fromkeys(known[0], "the robot")
    for owner, keys in zip(names, known[1:], strict=True):
        for key in keys:
            if key in taken:
                raise ValueError(
                    f"keyword {key!r} is of {taken[key]} and of {owner}; a part of yours needs "
                    "another name for it"
                )
        taken |= dict.fromkeys(keys, owner)


def _refuse(key: str, keywords: dict[str, Any], task: str, physics: str) -> None:
    """Say whose a keyword is, or which one was meant."""
    owners = [owner for name, owner in all_keywords() if name == key]
    here = f"with task={task!r} and physics={physics!r}"
    if owners:
        raise ValueError(
            f"{key} needs {' or '.join(dict.fromkeys(owners))}, got {key}={keywords[key]!r} {here}"
        )
    names = sorted({name for name, _ in all_keywords()})
    raise TypeError(f"unknown keyword {key!r} {here}{nearest(key, names)}; there are {names}")
