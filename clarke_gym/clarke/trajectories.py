r"""Smooth motions on the manifold under velocity, acceleration and jerk limits, in closed form.

A straight line between two Clarke coordinates with the quintic time law
:math:`s(\tau) = 10\tau^3 - 15\tau^4 + 6\tau^5` starts and ends at rest. Its peaks are
:math:`15/8`, :math:`10/\sqrt3` and 60 times :math:`D/T`, :math:`D/T^2` and :math:`D/T^3`, so the
shortest duration under all limits has a closed form. Since a joint of a symmetric ring never
moves faster than the Clarke coordinates, every joint keeps the same limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from clarke_gym.numerics.arrays import Array, array_namespace, as_floating

PEAK_SPEED = 15.0 / 8.0
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)
PEAK_JERK = 60.0


def shortest_duration(
    distance: Array,
    *,
    max_speed: float = math.inf,
    max_acceleration: float = math.inf,
    max_jerk: float = math.inf,
) -> Array:
    """Return the duration in which the quintic motion over a distance just keeps all limits.

    Parameters
    ----------
    distance : array, shape (...)
        Length of the straight line [m].
    max_speed, max_acceleration, max_jerk : float
        [m/s], [m/s^2], [m/s^3]; infinite if not given, at least one finite.

    Returns
    -------
    array, shape (...)
        [s].

    Raises
    ------
    TypeError, ValueError
        If `distance` is not real, a limit is not positive, or there is no limit.

    Examples
    --------
    >>> shortest_duration(0.01, max_speed=0.01)
    np.float64(1.875)
    """
    limits = {"max_speed": max_speed, "max_acceleration": max_acceleration, "max_jerk": max_jerk}
    for name, value in limits.items():
        if not value > 0.0:
            raise ValueError(f"{name} must be positive, got {value!r}")
    if all(math.isinf(value) for value in limits.values()):
        raise ValueError("at least one of max_speed, max_acceleration and max_jerk must be finite")
    distance = as_floating(distance, "distance")
    xp = array_namespace(distance)
    # Roots of a zero distance have no finite gradient: a point moves in no time.
    still = distance == 0.0
    safe = xp.where(still, xp.ones_like(distance), distance)
    peaks = ((PEAK_SPEED, max_speed), (PEAK_ACCELERATION, max_acceleration), (PEAK_JERK, max_jerk))
    durations = [
        (peak * safe / limit) ** (1.0 / order)
        for order, (peak, limit) in enumerate(peaks, start=1)
        if not math.isinf(limit)
    ]
    longest = durations[0]
    for duration in durations[1:]:
        longest = xp.maximum(longest, duration)
    return xp.where(still, 0.0 * distance, longest)[()]


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A batch of quintic rest-to-rest motions along straight lines.

    Parameters
    ----------
    start, goal : array, shape (..., k)
        Clarke coordinates [m], one or several segments'.
    duration : array, shape (...)
        [s]; `between` chooses the shortest one under limits.

    Examples
    --------
    >>> import numpy as np
    >>> motion = Trajectory.between(np.zeros(2), np.array([0.01, 0.0]), max_speed=0.01)
    >>> motion.position(np.array([0.0, 0.9375, 1.875]))
    array([[0.   , 0.   ],
           [0.005, 0.   ],
           [0.01 , 0.   ]])
    """

    start: Array
    goal: Array
    duration: Array

    @classmethod
    def between(cls, start: Array, goal: Array, **limits: float) -> Trajectory:
        """Return the fastest motion under the limits of `shortest_duration`.

        With several segments' coordinates in one row, every pair keeps the limits and all arrive
        together.

        Parameters
        ----------
        start, goal : array, shape (..., k)
            [m], k even.
        **limits
            As in `shortest_duration`.

        Raises
        ------
        TypeError, ValueError
            If the arrays are not real, their last axes are not equal and even, or a limit is
            impossible.

        Examples
        --------
        >>> import numpy as np
        >>> Trajectory.between(np.zeros(2), np.array([0.0, 0.01]), max_speed=0.01).duration
        np.float64(1.875)
        """
        start, goal = as_floating(start, "start"), as_floating(goal, "goal")
        if goal.ndim == 0 or goal.shape[-1] % 2 or start.shape[-1:] != goal.shape[-1:]:
            raise ValueError(
                "start and goal must have equal, even last axes, got "
                f"{tuple(start.shape)} and {tuple(goal.shape)}"
            )
        gap = goal - start
        pairs = gap.reshape(*gap.shape[:-1], gap.shape[-1] // 2, 2)
        xp = array_namespace(gap)
        square = xp.amax((pairs * pairs).sum(-1), -1)
        still = square == 0.0
        root = xp.sqrt(xp.where(still, xp.ones_like(square), square))
        return cls(start, goal, shortest_duration(xp.where(still, 0.0 * square, root), **limits))

    def position(self, time: Array) -> Array:
        """Return the coordinates [m] at times [s] since the start; constant outside the motion.

        `time` has the shape (...) of the batch, or any shape for a single motion; so do the
        derivatives below.

        Examples
        --------
        >>> import numpy as np
        >>> motion = Trajectory(np.zeros(2), np.array([0.01, 0.0]), np.float64(1.0))
        >>> motion.position(0.5)
        array([0.005, 0.   ])
        """
        return self.start + self._along(time, (10.0, -15.0, 6.0), 3, 0)

    def velocity(self, time: Array) -> Array:
        """Return the velocity [m/s] at times [s].

        Examples
        --------
        >>> import numpy as np
        >>> motion = Trajectory(np.zeros(2), np.array([0.01, 0.0]), np.float64(1.0))
        >>> motion.velocity(0.5)
        array([0.01875, 0.     ])
        """
        return self._along(time, (30.0, -60.0, 30.0), 2, 1)

    def acceleration(self, time: Array) -> Array:
        """Return the acceleration [m/s^2] at times [s].

        Examples
        --------
        >>> import numpy as np
        >>> motion = Trajectory(np.zeros(2), np.array([0.01, 0.0]), np.float64(1.0))
        >>> motion.acceleration(0.5)
        array([0., 0.])
        """
        return self._along(time, (60.0, -180.0, 120.0), 1, 2)

    def jerk(self, time: Array) -> Array:
        """Return the jerk [m/s^3] at times [s].

        Examples
        --------
        >>> import numpy as np
        >>> motion = Trajectory(np.zeros(2), np.array([0.01, 0.0]), np.float64(1.0))
        >>> motion.jerk(0.5)
        array([-0.3, -0. ])
        """
        return self._along(time, (60.0, -360.0, 360.0), 0, 3)

    def _along(
        self, time: Array, coefficients: tuple[float, float, float], power: int, order: int
    ) -> Array:
        gap = self.goal - self.start
        xp = array_namespace(gap)
        duration = self.duration
        still = duration == 0.0
        length = xp.where(still, xp.ones_like(duration), duration)
        share = time / length
        moving = (share > 0.0) & (share < 1.0)
        inside = xp.where(moving, share, 0.0 * share)
        a, b, c = coefficients
        value = (a + inside * (b + inside * c)) * inside**power
        if order == 0:
            value = xp.where(share >= 1.0, xp.ones_like(value), value)
            value = xp.where(still & (share >= 0.0), xp.ones_like(value), value)
        else:
            value = xp.where(moving, value, 0.0 * value) / length**order
        return value[..., None] * gap
