"""Signals of a simulated loop obey its controller; those that are logged late do so at another lag."""

import numpy as np
import pytest

from inputdesign_cli.identification import shifted
from inputdesign_cli.plant import Rational, TransferMatrix

PI = TransferMatrix.build([[[0.6, -0.4]]], [[[1.0, -1.0]]])
GAIN = TransferMatrix.build([[[0.5]]], [[[1.0]]])


def loop(controller, samples=300, level=0.0, seed=0):
    """u, y, r of y(t) = 0.8 y(t-1) + 0.5 u(t-1) + e(t) under u = r - C y, by its recursions."""
    rng = np.random.default_rng(seed)
    p, q = controller.numerator[0, 0], controller.denominator[0]
    r, e = rng.choice([-1.0, 1.0], samples), 0.3 * rng.standard_normal(samples)
    u, y, c = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    for t in range(samples):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 1] + e[t] if t else e[t]
        past = sum(p[k] * y[t - k] for k in range(len(p)) if k <= t)
        c[t] = past - sum(q[k] * c[t - k] for k in range(1, len(q)) if k <= t)
        u[t] = r[t] - c[t]
    return u[:, None] + level, y[:, None] + 2.0 * level, r[:, None]


@pytest.mark.parametrize("controller", [PI, GAIN], ids=["PI", "gain"])
@pytest.mark.parametrize("level", [0.0, 50.0])
def test_signals_as_they_were_obey_the_controller(controller, level):
    u, y, r = loop(controller, level=level)
    assert shifted(controller, u, y, r, [len(u)]) == []
    # Rounding, and a controller that is not quite that of the spec, are no shift.
    assert shifted(controller, np.round(u, 1), np.round(y, 1), r, [len(u)]) == []
    assert shifted(controller.scaled(Rational.build([1.2])), u, y, r, [len(u)]) == []


@pytest.mark.parametrize("controller", [PI, GAIN], ids=["PI", "gain"])
@pytest.mark.parametrize(("letter", "lag"), [("u", 1), ("u", 2), ("u", -1), ("y", 1), ("r", -1)])
def test_a_signal_that_was_logged_at_another_time_is_found(controller, letter, lag):
    signals = dict(zip("uyr", loop(controller, level=50.0), strict=True))
    signals[letter] = np.roll(signals[letter], lag, axis=0)
    for lengths in ([300], [120, 180]):
        (found,) = shifted(controller, signals["u"], signals["y"], signals["r"], lengths)
        assert (found.letter, found.lag) == (letter, lag)
        assert found.then < 1e-6 or lengths != [300]
        assert found.left > 0.1


def test_each_input_has_its_own_law():
    """Two loops side by side: the second input alone is late."""
    C = TransferMatrix.build([[[0.6, -0.4], [0.0]], [[0.0], [0.6, -0.4]]], [[[1.0, -1.0]] * 2] * 2)
    one, two = loop(PI, seed=1), loop(PI, seed=2)
    u, y, r = (np.column_stack([a, b]) for a, b in zip(one, two, strict=True))
    assert shifted(C, u, y, r, [300]) == []
    u[:, 1] = np.roll(u[:, 1], 1)
    (found,) = shifted(C, u, y, r, [300])
    assert (found.letter, found.channel, found.lag) == ("u", 1, 1)


def test_short_stretches_say_nothing():
    u, y, r = loop(PI, samples=20)
    assert shifted(PI, np.roll(u, 1), y, r, [20]) == []
