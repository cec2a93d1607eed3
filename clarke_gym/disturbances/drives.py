"""What happens between a command and a tendon: play, friction, delay, slack."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from clarke_gym.disturbances.base import Disturbance, register_disturbance
from clarke_gym.numerics.arrays import FloatArray
from clarke_gym.numerics.linear_map import map_rows
from clarke_gym.robots.robot import Robot

MOST_GAP = 0.05
"""Largest backlash, over the largest displacement of the first segment's tendons."""

MOST_FRICTION = 0.4
"""Largest coefficient of capstan friction between a tendon and its holes."""

FRICTION_GAP = 0.05
"""Play per (e^(mu phi) - 1), over the largest displacement: what a tendon gives before it slips."""

MOST_DELAY = 2
"""Longest delay of commands, in control periods."""

MOST_SLACK = 0.1
"""Longest slack of a tendon, over the largest displacement of its segment's."""


class Play(Disturbance):
    """A tendon moves only once its drive has crossed a gap (the play operator).

    Source: Krasnosel'skii and Pokrovskii, "Systems with Hysteresis", 1989.
    """

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._held = np.zeros((num_envs, robot.n_joints))
        self._most = float(robot.max_clarke[0]) * strength

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin with tendons in the middle of their gaps."""
        del numbers
        self._held[rows] = command

    def gap(self, command: FloatArray) -> FloatArray:
        """Return the width of the gaps [m], (B, N) or (B, 1)."""
        raise NotImplementedError

    def step(self, command: FloatArray) -> FloatArray:
        """Return where the drives have taken the tendons to [m]."""
        half = 0.5 * self.gap(command)
        self._held = np.minimum(np.maximum(self._held, command - half), command + half)
        return self._held

    def get_state(self) -> dict[str, Any]:
        """Return where the tendons are."""
        return {"held": self._held.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to it."""
        self._held = state["held"].copy()


@register_disturbance("backlash")
class Backlash(Play):
    """Play of drives and joints: a gap drawn for every episode and robot."""

    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1

    def gap(self, command: FloatArray) -> FloatArray:
        """Return the width of the gaps [m]."""
        del command
        return MOST_GAP * self._most * self.drawn


@register_disturbance("friction")
class Friction(Play):
    r"""Capstan friction: the more a tendon is bent round its holes, the later it slips.

    Euler and Eytelwein's :math:`T_2 = T_1 e^{\mu\phi}` over the bend phi of the backbone leaves a
    stick band that grows as :math:`e^{\mu\phi} - 1`; the coefficient mu is drawn for every episode.
    Tension has no part in it: `capstan` has.
    """

    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1

    def gap(self, command: FloatArray) -> FloatArray:
        """Return the width of the gaps [m]."""
        clarke = map_rows(command, self.robot.encoder.T).reshape(len(command), -1, 2)
        bend = np.hypot(clarke[..., 0], clarke[..., 1]) / self.robot.pitch_radii
        grip = np.expm1(MOST_FRICTION * self.drawn * bend)
        return np.repeat(FRICTION_GAP * self._most * grip, self.robot.n_tendons, axis=1)


@register_disturbance("command_delay")
class CommandDelay(Disturbance):
    """Commands arrive 0 to 2 control periods late, a number drawn for every episode."""

    numbers: ClassVar[int] = 1
    hidden: ClassVar[int] = 1

    def __init__(self, robot: Robot, num_envs: int, strength: float = 1.0) -> None:
        super().__init__(robot, num_envs, strength)
        self._longest = max(1, round(MOST_DELAY * strength))
        self._kept = np.zeros((num_envs, self._longest + 1, robot.n_joints))

    def reset(self, rows: NDArray[np.intp], numbers: FloatArray, command: FloatArray) -> None:
        """Begin as if the command had been the same for long."""
        del numbers
        self._kept[rows] = command[:, None]

    def step(self, command: FloatArray) -> FloatArray:
        """Return the commands that arrive now [m]."""
        self._kept = np.concatenate([command[:, None], self._kept[:, :-1]], axis=1)
        late = np.floor(self.drawn[:, 0] * (self._longest + 1)).astype(np.intp)
        arrived: FloatArray = self._kept[np.arange(self.num_envs), late]
        return arrived

    def get_state(self) -> dict[str, Any]:
        """Return the commands on their way."""
        return {"kept": self._kept.copy()}

    def set_state(self, state: dict[str, Any]) -> None:
        """Return to them."""
        self._kept = state["kept"].copy()


@register_disturbance("slack_tendon")
class SlackTendon(Disturbance):
    """One tendon is too long by a length drawn for every episode, as is which one."""

    numbers: ClassVar[int] = 2
    hidden: ClassVar[int] = 2

    def step(self, command: FloatArray) -> FloatArray:
        """Return commands less the slack that is taken up first [m]."""
        index = (self.drawn[:, 0] * self.robot.n_joints).astype(np.intp)
        most = MOST_SLACK * self.strength * np.repeat(self.robot.max_clarke, self.robot.n_tendons)
        reached = command.copy()
        reached[np.arange(self.num_envs), index] -= most[index] * self.drawn[:, 1]
        return reached
