"""Samples that are given twice are seen; independent noise and spikes are not taken for them."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification.repeated import repetition


def white(samples, channels=1, seed=0):
    return np.random.default_rng(seed).standard_normal((samples, channels))


def test_errors_of_their_own_do_not_come_again():
    assert [seed for seed in range(200) if repetition(white(500, 1 + seed % 2, seed)) is not None] == []


@pytest.mark.parametrize("pole", [0.9, 0.99, 0.999])
def test_coloured_errors_of_a_wrong_model_are_no_copies(pole):
    """Slow errors rise and fall together for thirty samples now and then."""
    found = [
        seed
        for seed in range(100)
        if repetition(scipy.signal.lfilter([1.0], [1.0, -pole], white(720, seed=seed), axis=0)) is not None
    ]
    assert found == []


@pytest.mark.parametrize("start", [0, 300, 450])
@pytest.mark.parametrize("channels", [1, 2])
def test_a_stretch_that_is_given_twice_is_found(start, channels):
    e = white(600, channels)
    found = repetition(np.concatenate([e, e[start:]]))
    assert (found.first, found.second) == pytest.approx((start, 600), abs=15)
    assert found.length == pytest.approx(600 - start, abs=15)


@pytest.mark.parametrize(
    "copied",
    [
        lambda e: np.round(e),  # to one standard deviation
        lambda e: e + 0.2,
        lambda e: -3.0 * e,
        lambda e: e + 0.2 * white(len(e), seed=9),
        lambda e: e[100:350],
    ],
)
def test_what_is_done_to_a_copy_does_not_hide_it(copied):
    e = white(500)
    assert repetition(np.concatenate([e, copied(e)])).length >= 200


def test_spikes_at_the_start_of_every_record_are_no_copies():
    records = [white(300, seed=seed) for seed in range(4)]
    for record in records:
        record[0] += 500.0
    assert repetition(np.concatenate(records)) is None


def test_errors_that_are_mostly_zero_say_nothing():
    assert repetition(np.zeros((400, 1))) is None
    assert repetition(white(40)) is None


def test_what_inputs_bring_again_is_not_given_twice():
    """The same input twice through a response that the model lacks, with noise of its own or the same."""
    u = np.tile(white(300, seed=3), (2, 1))
    missing = 2.0 * scipy.signal.lfilter([0.0, 1.0], [1.0, -0.5], u, axis=0)
    errors = missing + 0.2 * white(600, seed=4)
    assert repetition(errors) is not None
    assert repetition(errors, u) is None
    once = missing[:300] + 0.2 * white(300, seed=5)
    assert repetition(np.concatenate([once, once]), u).length >= 200
    assert repetition(errors, np.ones((600, 1))) is not None


def loop(proportional, integral, derivative, seed, on_u=0.0, grid=0.0, samples=800):
    """Errors and inputs (samples, 1) of y = 0.9 y + 0.1 u(t - 3) + e under a PID and steps of a reference."""
    rng = np.random.default_rng(seed)
    e, w = 0.05 * rng.standard_normal(samples), on_u * rng.standard_normal(samples)
    r = np.repeat(0.3 * rng.choice([-1.0, 1.0], samples // 50), 50)
    u, y, control = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    total = 0.0
    for t in range(samples):
        y[t] = e[t] + (0.9 * y[t - 1] if t else 0.0) + (0.1 * u[t - 3] if t >= 3 else 0.0)
        control[t] = r[t] - y[t]
        total += integral * control[t]
        u[t] = proportional * control[t] + total + derivative * (control[t] - control[t - 1] * (t > 0)) + w[t]
        u[t] = np.round(u[t] / grid) * grid if grid else u[t]
    return e[:, None], u[:, None]


LOOPS = [(1.0, 0.0, 0.0), (1.0, 0.08, 0.0), (1.0, 0.08, 0.5)]


@pytest.mark.first(6)
@pytest.mark.parametrize("feedback", [True, False])
@pytest.mark.parametrize("law", LOOPS)
@pytest.mark.parametrize("disturbed", [{}, {"on_u": 0.01}, {"grid": 0.02}])
def test_a_controller_that_tells_the_noise_gives_no_samples_twice(law, disturbed, feedback):
    """The errors are the noise itself; the loop may be known or not."""
    loops = [loop(*law, seed, **disturbed) for seed in range(20)]
    assert [seed for seed, (e, u) in enumerate(loops) if repetition(e, u, feedback=feedback)] == []


@pytest.mark.parametrize("law", LOOPS)
@pytest.mark.parametrize("length", [100, 300])
def test_samples_of_a_loop_that_are_given_twice_are_found(law, length):
    for seed in range(20):
        both = [np.concatenate([x, x[200 : 200 + length]]) for x in loop(*law, seed)]
        found = repetition(*both, feedback=True)
        assert found is not None
        assert found.length == pytest.approx(length, abs=40)
