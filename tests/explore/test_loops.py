"""Loops whose reference moves in steps are seen, open loops are not called loops, and the plant is told."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli.explore import answers_output, explore_records

# B from lag zero, A, and a PI controller that holds it: gain and integral.
PLANTS = {
    "lag": ([0, 0, 0.2], [1, -0.8], (0.8, 0.1)),
    "slow": ([0, 0.1], [1, -0.9], (3.0, 0.0)),
    "second order": ([0, 0, 0, 0.06], [1, -1.5, 0.56], (0.6, 0.05)),
    "dead time": ([0, 0, 0, 0, 0, 0.3], [1, -0.7], (0.4, 0.0)),
    "negative": ([0, 0, -0.4], [1, -0.8], (-0.8, 0.0)),
}
OPEN = {
    **PLANTS,
    "gain": ([3.0], [1], None),
    "at once": ([0.5, 0.2], [1, -0.7], None),
    "at once, inverse": ([-0.3, 0.6], [1, -0.7], None),
}
NOISE = {"white": [1, 0], "ar": [1, -0.9], "slow": [1, -0.97], "walk": [1, -0.999]}


def steps(rng, samples, hold, levels=(-1.0, 1.0)):
    return np.repeat(rng.choice(levels, samples // hold + 1), hold)[:samples]


def noise(rng, samples, name, size):
    v = scipy.signal.lfilter([1.0], NOISE[name], rng.standard_normal(samples))
    return size * v / v.std()


def looped(rng, plant, colour, hold, samples=800, size=0.3, reference=None):
    """u (n, 1) and y (n, 1) of a loop that answers y(t) by u(t), its reference held if none is given."""
    b, a, (gain, integral) = PLANTS[plant]
    r = steps(rng, samples, hold) if reference is None else reference
    v = noise(rng, samples, colour, size)
    u, y, x, total = np.zeros(samples), np.zeros(samples), np.zeros(samples), 0.0
    for k in range(samples):
        x[k] = sum(c * u[k - i] for i, c in enumerate(b) if 0 < i <= k)
        x[k] -= sum(c * x[k - i] for i, c in enumerate(a) if 0 < i <= k)
        y[k] = x[k] + v[k]
        total += integral * (r[k] - y[k])
        u[k] = gain * (r[k] - y[k]) + total
    return u[:, None], y[:, None]


def moved(rng, kind, samples):
    """An input of an open loop."""
    smooth = scipy.signal.lfilter([0.2], [1, -0.8], steps(rng, samples, 15))
    return {
        "held": lambda: steps(rng, samples, 5),
        "levels": lambda: steps(rng, samples, 20, rng.standard_normal(20)),
        "prbs": lambda: steps(rng, samples, 1),
        "sines": lambda: np.cos(np.outer(np.arange(samples), rng.uniform(0.02, 1.5, 4))).sum(axis=1),
        "walk": lambda: np.cumsum(rng.standard_normal(samples)),
        "step": lambda: np.where(np.arange(samples) < samples // 3, 0.0, 1.0),
        "white": lambda: rng.standard_normal(samples),
        "smooth": lambda: smooth,
        "rounded": lambda: np.round(8.0 * smooth) / 8.0,
        "dither": lambda: steps(rng, samples, 15) + 0.1 * rng.standard_normal(samples),
    }[kind]()


def driven(rng, kind, samples):
    """u (n, 1) and y (n, 1) of some plant in open loop."""
    b, a, _ = OPEN[rng.choice(list(OPEN))]
    u = moved(rng, kind, samples)
    x = scipy.signal.lfilter(b, a, u)
    v = noise(rng, samples, rng.choice(list(NOISE)), rng.choice([0.1, 0.3, 1.0]) * x.std())
    return u[:, None], (x + v)[:, None]


KINDS = ("held", "levels", "prbs", "sines", "walk", "step", "white", "smooth", "rounded", "dither")


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(("colour", "hold"), [("ar", 10), ("walk", 20)])
def test_a_loop_whose_reference_is_held_is_seen(plant, colour, hold):
    """Between steps u tells all of y that past outputs could; what it does at once is left."""
    record = looped(np.random.default_rng(1), plant, colour, hold)
    assert [j for j, _ in answers_output([record])] == [0]


@pytest.mark.parametrize("plant", ["at once", "at once, inverse", "gain"])
def test_a_plant_that_answers_at_once_is_no_controller(plant):
    """What is new in u and y goes together, at the jumps of u as well."""
    rng = np.random.default_rng(2)
    b, a, _ = OPEN[plant]
    u = moved(rng, "dither", 800)
    y = scipy.signal.lfilter(b, a, u) + noise(rng, 800, "ar", 0.05)
    assert answers_output([(u[:, None], y[:, None])]) == []


@pytest.mark.parametrize("kind", KINDS)
def test_an_open_loop_is_not_called_a_loop(kind):
    rng = np.random.default_rng(3)
    for samples in (130, 600):
        assert answers_output([driven(rng, kind, samples)]) == []


@pytest.mark.parametrize("shape", ["square", "lagged", "slow", "triangle", "sawtooth", "staircase"])
def test_an_input_that_repeats_is_foretold_by_no_output(shape):
    """Once the plant has settled, what is left of u and of y comes with every period, and is no noise."""
    for period in (19.0, 31.4, 48.3, 62.8, 89.8):
        for seed, size in ((0, 0.05), (1, 0.005)):
            rng = np.random.default_rng(seed)
            phase = np.arange(1400) / period + rng.random()
            square = np.sign(np.sin(2.0 * np.pi * phase))
            u = {
                "square": square,
                "lagged": scipy.signal.lfilter([0.3], [1, -0.7], square),
                "slow": scipy.signal.lfilter([0.05], [1, -0.95], square),
                "triangle": np.arcsin(np.sin(2.0 * np.pi * phase)),
                "sawtooth": phase % 1.0,
                "staircase": np.round(2.0 * np.sin(2.0 * np.pi * phase)),
            }[shape]
            y = scipy.signal.lfilter(*OPEN["second order"][:2], u) + size * rng.standard_normal(1400)
            assert answers_output([(u[600:, None], y[600:, None])]) == []


def play(x, width):
    out, at = np.zeros_like(x), 0.0
    for k, value in enumerate(x):
        out[k] = at = min(max(at, value - width), value + width)
    return out


CURVES = {
    "clipping": lambda x: np.clip(x, -1.0, 1.0),
    "cube": lambda x: x + 0.15 * x**3,
    "dead zone": lambda x: np.sign(x) * np.maximum(np.abs(x) - 0.5, 0.0),
    "play": lambda x: play(x, 0.4),
}


def one_period(rng, kind, period):
    t = np.arange(period)
    lines = np.arange(1, period // 3, 2 if kind == "odd lines" else 1)
    lines = lines[rng.random(lines.size) < 0.7]
    x = {
        "levels": lambda: np.repeat(rng.standard_normal(period // 5 + 1), 5)[:period],
        "four levels": lambda: rng.choice([-1.0, -0.2, 0.5, 1.5], period),
    }.get(kind, lambda: np.cos(2 * np.pi * np.outer(t, lines) / period + rng.random(lines.size) * 7).sum(1))()
    return x / x.std()


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(["lines", "odd lines", "levels", "four levels"]),
    curve=st.sampled_from(sorted(CURVES)),
    period=st.integers(60, 400),
    times=st.integers(2, 6),
    cut=st.floats(0.0, 0.5),
    rest=st.integers(0, 150),
)
def test_no_nonlinear_plant_makes_a_repeating_input_a_loop(seed, kind, curve, period, times, cut, rest):
    """In one record, two with a gap, or from rest: what comes again without the noise does not answer."""
    rng = np.random.default_rng(seed)
    u = np.concatenate([np.zeros(rest), np.tile(one_period(rng, kind, period), times)])
    x = scipy.signal.lfilter([0, 0.4, 0.1], [1, -1.5, 0.8], CURVES[curve](u))
    y = x + noise(rng, len(u), "ar", 0.1 * x.std())
    records = [(u[:, None], y[:, None])]
    assert answers_output(records) == []
    at = rest + int(cut * (len(u) - rest - 2 * period))
    if at > rest:
        assert answers_output([(u[:at, None], y[:at, None]), (u[at:, None], y[at:, None])]) == []


@pytest.mark.parametrize("size", [0.01, 0.1, 0.3])
@pytest.mark.parametrize("plant", PLANTS)
def test_a_loop_with_a_reference_that_repeats_is_seen(plant, size):
    """The noise that comes round the loop does not repeat, and so the input does not."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        reference = np.tile(one_period(rng, "lines", 200), 5)
        record = looped(rng, plant, "ar", 1, samples=1000, size=size, reference=reference)
        assert [j for j, _ in answers_output([record])] == [0]


@pytest.mark.slow
def test_most_loops_are_seen_and_no_open_loop_is_called_one():
    """At a level of 1e-4; a loop whose noise is hidden by its own input is missed now and then."""
    rng = np.random.default_rng(4)
    seen = [
        bool(answers_output([looped(rng, plant, colour, hold, samples)]))
        for plant in PLANTS
        for colour in NOISE
        for hold in (5, 10, 20)
        for samples in (400, 800)
    ]
    assert np.mean(seen) > 0.97
    blamed = [answers_output([driven(rng, kind, n)]) for kind in KINDS for n in (130, 400, 1500) * 10]
    assert not any(blamed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [13, 14])
@pytest.mark.parametrize(("plant", "hold"), [("lag", 20), ("second order", 10), ("dead time", 10)])
def test_the_plant_in_a_loop_is_told_and_called_linear(seed, plant, hold):
    """Within four standard deviations of the truth, in units of the plant's largest gain."""
    record = looped(np.random.default_rng(seed), plant, "ar", hold)
    found = explore_records([record], feedback=True)
    w = np.geomspace(0.02, 2.0, 20)
    b, a, _ = PLANTS[plant]
    z = np.exp(-1j * w)
    G = np.polyval(b[::-1], z) / np.polyval(a[::-1], z)
    away = np.abs(found.model.plant_at(w)[:, 0, 0] - G)
    spread = np.linalg.solve(found.estimate.factor, found.model.plant_gradient(w)[:, :, 0, 0].T)
    allowed = 4.0 * np.linalg.norm(spread, axis=0) + 0.03 * np.abs(G).max()
    assert np.all(away < allowed)
    assert not any(test.fault == "nonlinear" for test in found.estimate.failed)
