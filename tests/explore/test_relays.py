"""Thermostats are loops, whatever is known of the plant; inputs that someone switches are none."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import answers_output
from inputdesign_cli.explore.relays import told_by_levels


def ar(rng, samples, pole, size):
    v = scipy.signal.lfilter([1.0], [1.0, -pole], rng.standard_normal(samples + 200))[200:]
    return size * v / v.std()


def room(rng, *, samples=800, step=1.0, constant=90.0, dead=2, rounded=0.0, late=0, set_point=None, sign=1.0):
    """u (n, 1), y (n, 1): a heater that is on below 0.4 under a set point, and off above as much over it."""
    outside = ar(rng, samples, 0.99, 1.0)
    levels = np.full(samples, 20.0) if set_point is None else set_point
    pole, x, on = np.exp(-step / constant), 20.0, 0.0
    u, y = np.zeros(samples), np.zeros(samples)
    for t in range(samples):
        y[t] = x + 0.03 * rng.standard_normal()
        seen = y[max(t - late, 0)]
        on = 1.0 if seen < levels[t] - 0.4 else 0.0 if seen > levels[t] + 0.4 else on
        u[t] = on
        x = pole * x + (1.0 - pole) * (20.0 * u[t - dead] + 10.0 + outside[t])
    y = np.round(y / rounded) * rounded if rounded else y
    return u[:, None], sign * y[:, None]


def alternating(rng, lengths, samples):
    """An input of two levels whose phases last so long."""
    return np.concatenate([np.full(int(k), i % 2.0) for i, k in enumerate(lengths)])[:samples, None]


SWITCHED = {
    "clock": lambda rng, n: np.full(n, 12),
    "coin": lambda rng, n: rng.geometric(0.1, n),
    "any": lambda rng, n: rng.integers(3, 40, n),
    "two times": lambda rng, n: rng.choice([4, 11], n),
    "operator": lambda rng, n: rng.integers(15, 60, n),
    "gamma": lambda rng, n: 2.0 + rng.gamma(4.0, 4.0, n),
    "pulses": lambda rng, n: np.ravel([(k, 20 - k) for k in rng.integers(3, 17, n // 2)]),
    "duty of an operator": lambda rng, n: np.ravel([(k, 20 - k) for k in rng.integers(3, 17, n).repeat(8)]),
}
PLANTS = [
    ([0.0, 0.1], [1.0, -0.9]),
    ([3.0], [1.0]),
    ([-0.3, 0.6], [1.0, -0.7]),
    ([0.0] * 6 + [0.1], [1.0, -0.95]),
    ([0.0, 0.1], [1.0, -1.8, 0.9]),
]


@pytest.mark.parametrize(
    ("kind", "share"),
    [
        ({}, 1.0),
        ({"late": 1}, 0.8),
        ({"sign": -1.0}, 1.0),
        ({"rounded": 0.1}, 0.8),
        ({"step": 5.0, "constant": 300.0, "rounded": 0.1, "dead": 1}, 0.8),
        ({"set_point": 20.0 + np.repeat([0.0, 1.0, -0.5, 0.7], 200)}, 0.6),
    ],
)
def test_a_thermostat_is_a_loop(kind, share):
    """Also one that answers a sample late, is read in tenths, or has a set point that moves at times."""
    seen = [answers_output([room(np.random.default_rng(seed), **kind)]) for seed in range(5)]
    assert np.mean([[j for j, _ in found] == [0] for found in seen]) >= share


@pytest.mark.parametrize("kind", SWITCHED)
@pytest.mark.parametrize("pole", [0.0, 0.9, 0.999])
def test_who_switches_without_looking_is_in_no_loop(kind, pole):
    """Of any times and any noise: also pulses of one period, whose width the plant remembers."""
    for seed, (b, a) in enumerate(PLANTS):
        rng = np.random.default_rng(seed)
        u = alternating(rng, SWITCHED[kind](rng, 200), 700)
        x = scipy.signal.lfilter(b, a, u[:, 0] - u.mean())
        y = x + ar(rng, len(u), pole, rng.choice([0.1, 1.0]) * x.std())
        assert told_by_levels([(u, y[:, None])], 0) > 1e-3


def test_records_of_one_room_tell_together():
    """What two records with a gap between them tell is no less than what one does, and not taken for one."""
    u, y = room(np.random.default_rng(1))
    first, second = [(u[at], y[at]) for at in (slice(0, 400), slice(400, None))]
    assert told_by_levels([first, second], 0) < told_by_levels([first], 0)


def test_nothing_is_told_of_other_inputs():
    rng = np.random.default_rng(5)
    u, y = rng.standard_normal((300, 1)), rng.standard_normal((300, 1))
    assert told_by_levels([(u, y)], 0) == 1.0
    assert told_by_levels([(np.ones((300, 1)), y)], 0) == 1.0
    assert told_by_levels([(alternating(rng, [200, 200], 300), y)], 0) == 1.0
