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
