"""Controllers that run at every k-th row of the log are seen; inputs that someone holds as long are not."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import answers_output
from inputdesign_cli.explore.held import of_moves

PLANTS = [
    ([0.0, 0.0, 0.1], [1.0, -0.9]),
    ([3.0], [1.0]),
    ([0.5, 0.2], [1.0, -0.7]),
    ([-0.3, 0.6], [1.0, -0.7]),
    ([0.0, 0.0, 0.0, 0.06], [1.0, -1.5, 0.56]),
]


def slow_loop(rng, every, samples=800):
    """u (n, 1), y (n, 1): a lag of dead time two, a PI controller that runs at every so many samples."""
    v = scipy.signal.lfilter([0.2], [1.0, -0.9], rng.standard_normal(samples))
    reference = np.repeat(rng.choice([-1.0, 1.0], samples // 60 + 1), 60)
    u, y, x, total, held = np.zeros(samples), np.zeros(samples), 0.0, 0.0, 0.0
    for t in range(samples):
        x = 0.9 * x + (0.1 * u[t - 2] if t >= 2 else 0.0)
        y[t] = x + v[t]
        if t % every == 0:
            total += 0.03 * every * (reference[t] - y[t])
            held = 0.6 * (reference[t] - y[t]) + total
        u[t] = held
    return u[:, None], y[:, None]


def held(rng, kind, every, samples):
    n = samples // every + 1
    values = {
        "levels": lambda: rng.standard_normal(n),
        "prbs": lambda: rng.choice([-1.0, 1.0], n),
        "walk": lambda: np.cumsum(rng.standard_normal(n)),
        "lagged": lambda: scipy.signal.lfilter([1.0], [1.0, -0.8], rng.standard_normal(n)),
    }[kind]()
    return np.repeat(values, every)[:samples, None]


@pytest.mark.parametrize(("every", "share"), [(2, 1.0), (4, 0.8), (5, 0.8), (10, 0.4)])
def test_a_controller_slower_than_the_log_is_seen(every, share):
    """Of every tenth row of 800 there are 80, and one reference in six of them moves."""
    seen = [answers_output([slow_loop(np.random.default_rng(seed), every)]) for seed in range(10)]
    assert np.mean([[j for j, _ in found] == [0] for found in seen]) >= share


@pytest.mark.parametrize("kind", ["levels", "prbs", "walk", "lagged"])
@pytest.mark.parametrize("every", [2, 5, 10])
def test_an_input_that_is_held_in_open_loop_answers_nothing(kind, every):
    """Of plants that act late, at once, or against their gain."""
    for seed, (b, a) in enumerate(PLANTS):
        rng = np.random.default_rng(seed)
        u = held(rng, kind, every, 800)
        x = scipy.signal.lfilter(b, a, u[:, 0])
        v = scipy.signal.lfilter([1.0], [1.0, -rng.choice([0.0, 0.9, 0.999])], rng.standard_normal(800))
        y = x + rng.choice([0.01, 0.1, 1.0]) * x.std() * v / v.std()
        assert answers_output([(u, y[:, None])]) == []


def test_rows_at_which_inputs_move_are_found_in_every_record():
    """By their common grid, of any phase; outputs are those at the move, and in the last row it is held."""
    rng = np.random.default_rng(3)
    u, y = np.repeat(rng.standard_normal((80, 2)), 5, axis=0), rng.standard_normal((400, 1))
    at, last = of_moves([(u, y), (u[3:], y[3:])])
    for (moved, now), (same, late), begin in zip(at, last, (0, 3), strict=True):
        rows = np.arange(5 if begin else 0, 400, 5)
        assert np.array_equal(moved, u[rows])
        assert np.array_equal(same, moved)
        assert np.array_equal(now, y[rows])
        assert np.array_equal(late, y[rows + 4])


def test_an_input_that_moves_at_any_row_or_hardly_ever_has_no_grid():
    rng = np.random.default_rng(4)
    y = rng.standard_normal((400, 1))
    assert of_moves([(rng.standard_normal((400, 1)), y)]) == []
    assert of_moves([(np.ones((400, 1)), y)]) == []
    assert of_moves([(np.repeat(rng.standard_normal((8, 1)), 50, axis=0), y)]) == []
    steps = np.repeat(rng.standard_normal((10, 1)), 40, axis=0)
    steps[200:] += np.repeat([[0.0], [1.0]], [5, 195], axis=0)
    assert of_moves([(steps, y)]) == []
