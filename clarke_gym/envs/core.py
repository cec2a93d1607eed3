"""The batched core: the only implementation of an episode, scalar or vector."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from clarke_gym import kinematics
from clarke_gym.disturbances import Disturbance, make_disturbances, parse
from clarke_gym.envs.config import EnvConfig
from clarke_gym.envs.episode import Episode
from clarke_gym.envs.limits import CommandLimits
from clarke_gym.envs.observer import Observer
from clarke_gym.envs.tally import Tally
from clarke_gym.envs.told import check_finite_rows, check_outcome, check_rows, check_start
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.batch import Batch, each, largest_magnitude
from clarke_gym.physics import loadable, physics_class
from clarke_gym.physics.base import Physics
from clarke_gym.representations import make_representation
from clarke_gym.representations.codecs import Decoder
from clarke_gym.robots.joint_vector import JointVector, Splitter
from clarke_gym.sensors import ORACLE, SENSORS, Plant
from clarke_gym.sensors.base import BOUND_MARGIN
from clarke_gym.tasks import GoalTask, Outcome, Task

if TYPE_CHECKING:
    from clarke_gym.rendering import Picture

SHOWN_STEPS = 40
"""Control periods for which pictures show where a goal will come to."""

FULL_LOAD = 2.0
"""Tension over pretension at which a tendon is drawn red."""

UNTENSIONED_LOAD_N = 20.0
"""The same tension [N] for a robot without pretension."""


class EnvCore:
    """A batch of B environments: robot x physics x task x sensors x disturbances.

    Parameters
    ----------
    config : EnvConfig
    batch : Batch
        One environment, or many.
    """

    def __init__(self, config: EnvConfig, batch: Batch) -> None:
        self.config, self.batch = config, batch
        self.robot = robot = config.make_robot()
        self.task = config.make_task(robot)
        strengths = parse(config.disturbances, config.physics)
        self.disturbances = make_disturbances(strengths, robot, batch.size, config.physics)
        self.physics = self._make_physics()
        self.actions = Decoder(make_representation(config.of_actions, robot), robot, batch)
        self._sensing = self._with("sense")
        self.observer = self._make_observer()
        self.limits = CommandLimits(robot, config.control, config.control_dt)
        self._splitter = Splitter(robot, batch)
        self._command = JointVector(batch.zeros(2 * robot.n_segments))
        self._radii = robot.pitch_radii
        # Hooks that do nothing cost nothing.
        self._steering, self._pulling, self._varying = (
            self._with(hook) for hook in ("step", "force", "vary")
        )
        self._task_pulls = type(self.task).force is not Task.force
        self.episode = Episode(
            self.task,
            batch.size,
            config.control_dt,
            config.longest_episode,
            # No reference back: nothing waits for the garbage collector.
            partial(_placed, config.task, self.physics, self._radii),
            sum(disturbance.numbers for disturbance in self.disturbances),
        )
        for disturbance in self.disturbances:
            disturbance.steps = self.episode.steps  # one clock for all
        self._tally = Tally(self.task.metrics, batch.size)
        self._tallies = any(metric.over != "now" for metric in self.task.metrics)
        self._picture: Picture | None = None
        self._pulled: FloatArray | None = None
        self._looked_at = False

    def _make_physics(self) -> Physics:
        """Return the physics of the robot that disturbances leave of the nominal one."""
        config, model = self.config, physics_class(self.config.physics)
        self._check_offers(f"task {config.task!r}", self.task.needs)
        robot = self.robot
        for disturbance in self.disturbances:
            robot = disturbance.make(robot)
        physics: Physics = model(
            robot, self.batch, config.control_dt, scene=self.task.scene, **config.physics_options
        )
        return physics

    def _check_offers(self, owner: str, needs: tuple[str, ...]) -> None:
        """Refuse a part whose nouns the physics does not have."""
        offers = physics_class(self.config.physics).OFFERS
        for noun in needs:
            if noun not in offers:
                having = [name for name, model in loadable() if noun in model.OFFERS]
                raise ValueError(
                    f"{owner} needs {noun}, which physics={self.config.physics!r} does not have; "
                    f"{having} do"
                )

    def _make_observer(self) -> Observer:
        """Return what writes observations with the sensors that are asked for."""
        config, goal = self.config, self.task.goal
        if config.goal_env and not isinstance(self.task, GoalTask):
            raise ValueError(f"goal_env needs a task with a goal; {config.task!r} has none")
        names = config.sensor_names
        if names is None:
            names = self.task.sensors
            if goal is not None and not config.goal_env:
                compared = isinstance(self.task, GoalTask)
                names = (*names, "goal", "goal_gap") if compared else (*names, "goal")
        elif goal is not None and not config.goal_env and "goal" not in names:
            names = (*names, "goal")
        plant = Plant(self.robot, self.physics, self.task, self.disturbances)
        if ORACLE in names:
            known = (name for name in SENSORS.names() if SENSORS[name].fits(plant))
            names = tuple(dict.fromkeys([*names, *known]))
            names = tuple(name for name in names if name != ORACLE)
            if config.goal_env:
                names = tuple(name for name in names if not name.startswith("goal"))
        if not names:
            raise ValueError(f"sensors={config.sensors!r} leaves nothing to observe; name one")
        for name in names:
            self._check_offers(f"sensor {name!r}", SENSORS[name].needs)
        sensors = [SENSORS[name](plant) for name in names]
        representation = make_representation(config.of_observations, self.robot)
        sensed = self._sensed if self._sensing else None
        return Observer(sensors, self.robot, representation, self.batch, sensed)

    # --- spaces -------------------------------------------------------------------------------

    def action_space(self) -> spaces.Box:
        """Return the space of one environment's actions."""
        return spaces.Box(-1.0, 1.0, (self.actions.representation.size,), np.float32)

    def observation_space(self) -> spaces.Space[Any]:
        """Return the space of one environment's observations."""
        high = self.observer.high
        observation = spaces.Box(-high, high, dtype=np.float32)
        goal = self.task.goal
        if not self.config.goal_env or goal is None:
            return observation
        most = goal.bound * BOUND_MARGIN * self.physics.displacement_bound
        bounds = spaces.Box(-most, most, (goal.size,), np.float32)
        return spaces.Dict(
            {"observation": observation, "achieved_goal": bounds, "desired_goal": bounds}
        )

    # --- episodes -----------------------------------------------------------------------------

    def reset(self, rows: NDArray[np.intp], goal: FloatArray | None = None) -> None:
        """Start new episodes in the environments `rows`, at rest, command equal to displacement."""
        clarke, rest = self.episode.start(rows, goal)
        self._place(rows)
        self._command = self._command.with_rows(self.batch, rows, clarke)
        first = 0
        for disturbance in self.disturbances:
            last = first + disturbance.numbers
            told = self._command.joint(self.robot)[rows]
            disturbance.begin(rows, self.episode.disturbed[rows, first:last], told)
            first = last
        self._vary(rows)
        self.physics.reset(rows, clarke, rest)
        if self._pulled is not None:
            self._pulled[rows] = 0.0

    def _place(self, rows: NDArray[np.intp], bodies: FloatArray | None = None) -> None:
        """Put placed bodies of some environments where their episodes have them, or as given."""
        if not self.task.scene.placed:
            return
        if bodies is None:
            bodies = self.task.places(self.episode.parameters[rows])
            shape = (len(rows), *self.task.scene.numbers.shape)
            check_finite_rows("bodies of task", self.config.task, bodies, shape)
        scene = self.task.scene
        if not scene.resized and np.abs(bodies[..., 6] - scene.numbers[:, 6]).max() > 1e-9:
            raise ValueError(
                f"task {self.config.task!r} places bodies of other radii than its scene has; "
                "Scene(..., resized=True) lets it"
            )
        self.physics.place(rows, np.broadcast_to(bodies, (len(rows), *bodies.shape[-2:])))

    def set_difficulty(self, difficulty: float | str) -> None:
        """Make the episodes that begin from now on easier or harder."""
        before = self.task.difficulty
        self.task.set_difficulty(difficulty)
        try:
            self.episode.prepare_again()
        except (ValueError, TypeError):
            self.task.set_difficulty(before)
            self.episode.prepare_again()
            raise

    def step(self, action: ArrayLike) -> None:
        """Advance all environments by one control period."""
        if not self.episode.begun:
            raise ResetNeeded("reset the environment before its first step")
        sent = self._command = self.limits.apply(self.actions.read(action), self._command)
        if self._steering:
            told = sent.joint(self.robot)
            shape = told.shape
            for disturbance in self._steering:
                told = disturbance.step(told)
                check_finite_rows("command of disturbance", disturbance.name, told, shape)
            sent = self._splitter.rows(told)
        if self._task_pulls or self._pulling:
            self._pulled = self._force()
            check_finite_rows(
                "force of a disturbance, or task",
                self.task.name,
                self._pulled,
                (self.batch.size, 3),
            )
            self.physics.pull(self._pulled)
        self.physics.step(sent)
        self.episode.advance()

    def _with(self, hook: str) -> list[Disturbance]:
        """Return the disturbances that have a hook."""
        return [disturbance for disturbance in self.disturbances if disturbance.overrides(hook)]

    def _force(self) -> FloatArray:
        """Return the forces on the tips [N], shape (B, 3), of task and disturbances."""
        force = self.task.force(self.episode.parameters, self.episode.time_s)
        for disturbance in self._pulling:
            force = force + disturbance.force()
        return force

    def _vary(self, rows: NDArray[np.intp]) -> None:
        """Give physics the numbers that the episodes of the environments `rows` have."""
        numbers: dict[str, FloatArray] = {}
        for disturbance in self._varying:
            numbers.update(disturbance.vary(disturbance.drawn[rows]))
        if numbers:
            self.physics.vary(rows, numbers)

    def _sensed(self, name: str, scale: FloatArray | float, values: FloatArray) -> FloatArray:
        """Return what disturbances leave of a sensor's true values (B, k)."""
        for disturbance in self._sensing:
            shape = values.shape
            values = disturbance.sense(name, scale, values.copy())  # theirs to write to
            check_rows("reading of disturbance", disturbance.name, values, shape)
        return values

    def outcome(self) -> Outcome:
        """Return what the task says of the current state."""
        self._evaluated = state = self.physics.state
        state.command_vector = self._command
        state.goal_after = self.episode.goal_after
        return self.task.evaluate(state, self.episode.goal)

    def begin_at(
        self,
        parameters: FloatArray,
        steps: int,
        command: FloatArray,
        displacement: FloatArray,
        bodies: FloatArray | None = None,
    ) -> None:
        """Put all environments into one episode, at rest: see `Imagination.begin`."""
        rows = np.arange(self.batch.size)
        self.episode.begin_at(parameters, steps)
        self._place(rows, bodies)
        told, there = (
            np.broadcast_to(pairs, (len(rows), *pairs.shape)) for pairs in (command, displacement)
        )
        self._command = JointVector(self.batch.zeros(2 * self.robot.n_segments))
        self._command = self._command.with_rows(self.batch, rows, told)
        self.physics.reset(rows, there)

    def evaluate(self) -> tuple[Outcome, NDArray[np.bool_], dict[str, Any]]:
        """Return the outcome of the current state, which episodes fail, and what `info` holds."""
        outcome, state = self.outcome(), self._evaluated
        if not self._looked_at:
            declared = [metric.name for metric in self.task.metrics]
            check_outcome(self.config.task, outcome, self.batch.size, declared)
            self._looked_at = True
        failure = outcome.failure
        ended = state.diverged.copy() if failure is None else state.diverged | failure
        info = {**outcome.metrics, "is_success": outcome.success}
        if self._tallies:
            info.update(self._tally.over(outcome.metrics, self.episode.steps))
        for name, term in outcome.terms.items():
            info[f"reward_{name}"] = term
        off = self._command.off_manifold
        info["off_manifold_m"] = (
            np.zeros(self.batch.size) if off is None else each(largest_magnitude(off))
        )
        info["diverged"] = state.diverged.copy()
        return outcome, ended, info

    def observe(self) -> Any:
        """Return the observation of the state that `evaluate` was asked for, as new arrays."""
        state, seen = self._evaluated, self.batch.seen
        observation = seen(self.observer.write(state, self.episode.goal))
        if not self.config.goal_env:
            return observation
        assert isinstance(self.task, GoalTask)
        return {
            "observation": observation,
            "achieved_goal": seen(self.task.seen(state)[0].copy()),
            "desired_goal": seen(self.episode.observed_goal),
        }

    def goal_reward(self, achieved: ArrayLike, desired: ArrayLike) -> Any:
        """Return the task's reward of goals as observed, shape (..., goal size)."""
        if not isinstance(self.task, GoalTask):
            raise ValueError(f"task {self.config.task!r} has no goal to ask rewards of")
        goals = [np.asarray(goal, dtype=np.float32) for goal in (achieved, desired)]
        lead = np.broadcast_shapes(*(goal.shape[:-1] for goal in goals))
        rows = [
            self.task.goal.meant(
                np.broadcast_to(goal, (*lead, goal.shape[-1])).reshape(-1, goal.shape[-1])
            )
            for goal in goals
        ]
        reward = self.task.score(*rows).reward
        return reward.reshape(lead) if lead else reward[0]

    # --- pictures -----------------------------------------------------------------------------

    def pictures(self, size: tuple[int, int], rows: Iterable[int]) -> Iterator[tuple[Any, Any]]:
        """Yield (rgb, depth) of the environments `rows`; `size` is (width, height) in pixels."""
        if not self.episode.begun:
            raise ResetNeeded("reset the environment before its first picture")
        if self._picture is None:
            from clarke_gym.rendering import Picture  # loads OpenGL

            self._picture = Picture(self.robot, *size, scene=self.task.scene)
        points = max(segment.n_disks for segment in self.robot.segments)
        curves, load = self.physics.backbone(points), self._tendon_load()
        success = self.evaluate()[0].success
        bodies, path = self.physics.surroundings.numbers, None
        if self.task.previews and self.task.goal is not None and self.task.goal.is_position:
            path = np.stack([self.episode.goal_after(k) for k in range(2, SHOWN_STEPS, 2)])
        for row in rows:
            shown = self._shown_goal(row)
            yield self._picture.draw(
                curves[row],
                points,
                load[row],
                shown,
                bool(success[row]),
                bodies[row],
                None if path is None else path[:, row],
                None if self._pulled is None else self._pulled[row],
            )

    def _shown_goal(self, row: int) -> FloatArray | None:
        """Return the goal as pictures take it: a position, with a direction, or some positions."""
        goal = self.task.goal
        if goal is None or not goal.labels[0].startswith("x"):
            return None
        numbers = self.episode.goal[row]
        if goal.unit == "m, 1" and goal.size == 6:
            return numbers
        kept = [k for k, label in enumerate(goal.labels) if label[0] in "xyz"]
        return numbers[kept].reshape(-1, 3)

    def close(self) -> None:
        """Free what pictures hold; a second call does nothing."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _tendon_load(self) -> FloatArray:
        """Return each tendon's load, 0 to 1: tension, or without one how far it is pulled."""
        state = self.physics.state
        if "tension" in self.physics.OFFERS:
            full = [FULL_LOAD * s.pretension_n or UNTENSIONED_LOAD_N for s in self.robot.segments]
            return state.tension / np.repeat(full, self.robot.n_tendons)
        return 0.5 + 0.5 * state.displacement / self.robot.joint_scale

    # --- checkpoints --------------------------------------------------------------------------

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle as the recipe and the state: simulators do not pickle."""
        return EnvCore, (self.config, self.batch), self.state()

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Return to a pickled state."""
        self.restore(state)

    def state(self) -> dict[str, Any]:
        """Return a copy of everything that the future depends on, generators included."""
        return {
            "physics": self.physics.get_state(),
            "episode": self.episode.get_state(),
            "command": self._command.get_state(),
            "tally": self._tally.get_state(),
            "bodies": self.physics.surroundings.numbers.copy(),
            "difficulty": self.task.difficulty,
            "pulled": None if self._pulled is None else self._pulled.copy(),
            "disturbances": [
                {"drawn": disturbance.drawn.copy(), "own": disturbance.get_state()}
                for disturbance in self.disturbances
            ],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Return to a state of `state()`, bit for bit."""
        self.task.set_difficulty(state["difficulty"])
        self.episode.set_state(state["episode"])
        # States of earlier versions lack what was added since: bodies, pulls and touches.
        if self.episode.begun:
            self._place(np.arange(self.batch.size), state.get("bodies"))
        for disturbance, kept in zip(self.disturbances, state["disturbances"], strict=True):
            disturbance.drawn = kept["drawn"].copy()
            disturbance.set_state(kept["own"])
        self._vary(np.arange(self.batch.size))
        self.physics.set_state(state["physics"])
        self._tally.set_state(state["tally"])
        pulled = state.get("pulled")
        self._pulled = None if pulled is None else pulled.copy()
        self._command = JointVector.from_state(self.batch, state["command"])


def _placed(
    task: str, physics: Physics, radii: FloatArray, bending: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return Clarke coordinates (R, S, 2) of starts, and the physics' coordinates at rest."""
    check_start(task, bending, physics.robot)
    clarke: FloatArray = kinematics.bending_to_clarke(bending, radii)
    return clarke, physics.rest(clarke)
