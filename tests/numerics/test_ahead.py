"""What is told ahead is what would be told at each step."""

import numpy as np

from clarke_gym.numerics.ahead import STEPS, Ahead


def test_rows_at_steps_of_their_own_get_what_they_would_be_told_at_once():
    rng, keys, asked = np.random.default_rng(0), np.arange(5.0), []

    def tell(rows, steps):
        asked.append(len(rows))
        return np.stack([keys[rows], steps.astype(float)], 1)

    kept, steps = Ahead(previews=2), np.zeros(5, np.int64)
    for _ in range(3 * STEPS):
        np.testing.assert_array_equal(kept.at(steps, tell), np.stack([keys, steps], 1))
        np.testing.assert_array_equal(kept.later(2), np.stack([keys, steps + 2], 1))
        steps = np.where(rng.random(5) < 0.02, 0, steps + 1)
    assert len(asked) < 3 * STEPS


def test_what_is_forgotten_is_told_anew():
    keys = np.zeros(3)

    def tell(rows, steps):
        return (keys[rows] + steps)[:, None]

    kept, steps = Ahead(), np.zeros(3, np.int64)
    kept.at(steps, tell)
    keys[:] = 1.0
    np.testing.assert_array_equal(kept.at(steps, tell)[:, 0], [0.0, 0.0, 0.0])
    kept.forget(np.array([1]))
    np.testing.assert_array_equal(kept.at(steps, tell)[:, 0], [0.0, 1.0, 0.0])
    kept.forget()
    np.testing.assert_array_equal(kept.at(steps, tell)[:, 0], [1.0, 1.0, 1.0])


def test_what_is_told_is_not_written_to():
    table = np.arange(4.0 * STEPS)[:, None]
    kept, steps = Ahead(), np.zeros(2, np.int64)
    kept.at(steps, lambda rows, steps: table[: len(rows)])
    kept.at(steps + STEPS, lambda rows, steps: table[-len(rows) :])
    np.testing.assert_array_equal(table[:, 0], np.arange(4.0 * STEPS))
