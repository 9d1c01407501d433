"""Feedback is found in loops, and neither in open loops nor in inputs that somebody sets."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.relation import answers_output, like_answers, only_answers
from tests.explore.plants import column
from tests.support.loops import LAWS, SAMPLES, loop

# B from lag zero on, A, and a stabilising PI controller: gain and integral gain.
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


def looped(rng, plant, colour, hold):
    """u (n, 1) and y (n, 1) of a loop in which u(t) depends on y(t), with a held reference."""
    b, a, (gain, integral) = PLANTS[plant]
    r, v = steps(rng, 800, hold), noise(rng, 800, colour, 0.3)
    u, y, x, total = np.zeros(800), np.zeros(800), np.zeros(800), 0.0
    for k in range(800):
        x[k] = sum(c * u[k - i] for i, c in enumerate(b) if 0 < i <= k)
        x[k] -= sum(c * x[k - i] for i, c in enumerate(a) if 0 < i <= k)
        y[k] = x[k] + v[k]
        total += integral * (r[k] - y[k])
        u[k] = gain * (r[k] - y[k]) + total
    return u[:, None], y[:, None]


def moved(rng, kind, samples):
    """An input (samples,) of an open loop."""
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
@pytest.mark.parametrize(("colour", "hold"), [("ar", 10), ("walk", 20), ("walk", 260)])
def test_feedback_is_found_in_a_loop_with_a_held_reference(plant, colour, hold):
    """Between steps past inputs predict as much as past outputs; only simultaneous changes are left."""
    record = looped(np.random.default_rng(1), plant, colour, hold)
    assert [j for j, _ in answers_output([record])] == [0]


@pytest.mark.parametrize("plant", ["at once", "at once, inverse", "gain"])
def test_direct_feedthrough_is_not_taken_for_feedback(plant):
    """The innovations of u and y are correlated, at the jumps of u as well."""
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


@pytest.mark.first(3)
@pytest.mark.parametrize("hold", [5, 20, 60])
@pytest.mark.parametrize("pole", [0.7, 0.99])
def test_a_held_input_is_not_taken_for_feedback(hold, pole):
    """Its truncated past predicts it badly, and the output of a slow plant seems to help."""
    rng = np.random.default_rng(hold)
    u = np.sign(rng.standard_normal(20000 // hold)).repeat(hold)
    e = scipy.signal.lfilter([1.0], [1.0, -0.8], 0.3 * rng.standard_normal(u.size))
    y = scipy.signal.lfilter([0.0, 0.0, 1.0 - pole], [1.0, -pole], u) + e
    assert answers_output([column(u, y)]) == []


@pytest.mark.parametrize("dither", [0.0, 0.1])
def test_an_input_that_is_an_exact_function_of_the_output_is_found(dither):
    rng = np.random.default_rng(14)
    e, d = rng.standard_normal((2, 800))
    y, u = np.zeros(800), np.zeros(800)
    for k in range(1, 800):
        y[k] = 0.9 * y[k - 1] + 0.4 * u[k - 1] + e[k]
        u[k] = u[k - 1] - 0.5 * y[k] + 0.4 * y[k - 1] + dither * d[k]
    assert only_answers([column(u, y)]) == ([] if dither else [0])


def test_a_sinusoid_is_not_taken_for_a_function_of_the_output():
    u = np.sin(0.3 * np.arange(500.0))[:, None]
    assert only_answers([(u, u + 0.1 * np.random.default_rng(1).standard_normal(u.shape))]) == []


SET = {
    "held": lambda rng: np.repeat(rng.standard_normal(SAMPLES // 5), 5),
    "white": lambda rng: rng.standard_normal(SAMPLES),
    "periodic": lambda rng: np.sin(0.1 * np.arange(SAMPLES)) + np.sin(0.37 * np.arange(SAMPLES)),
}


@pytest.mark.parametrize("make", SET.values(), ids=SET)
def test_inputs_that_somebody_sets_do_not_look_like_feedback(make):
    """The plant has direct feedthrough."""
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        u = make(rng)
        y = scipy.signal.lfilter([1.0, 0.4], [1.0, -0.8], u) + 0.1 * rng.standard_normal(SAMPLES)
        assert not like_answers([column(u, y)], 0, 0)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_inputs_from_a_controller_look_like_feedback(law):
    for steps, reported in ((0.0, 0.02), (0.3, 0.02), (0.3, 0.0)):
        assert like_answers([loop(3, law, steps=steps, reported=reported)], 0, 0)
