"""Answers that come later than delays are looked for: told where they are, and nowhere else."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import explore_records, fits
from inputdesign_cli.explore.late import far_answers
from inputdesign_cli.explore.regression import best_delays
from inputdesign_cli.plant import PolynomialModel

MOST, FURTHEST = 30, 80


def record(seed, late, hold, samples=180, before=200):
    """A lag behind `late` samples, in white noise of a seventh of the move; cut out of a longer record."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([-1.0, 1.0], (samples + before) // hold + 1), hold)[: samples + before]
    y = scipy.signal.lfilter([0.0] * late + [0.1], [1.0, -0.9], u) + 0.15 * rng.standard_normal(u.size)
    return u[before:, None], y[before:, None]


def answers(*parts):
    """With short delays of all orders up to five tried first, as the search does."""
    near, delays = [], (0,) * parts[0][0].shape[1]
    for n in range(1, 6):
        near.append(best_delays(parts, n, max(n, 2), MOST, delays))
        delays = near[-1].delays
    return far_answers(parts, near, MOST, FURTHEST)


@pytest.mark.parametrize("hold", [8, 12, 15])
@pytest.mark.parametrize("late", [45, 60, 72])
def test_late_answers_to_few_jumps_in_noise_are_told(hold, late):
    """What comes before them, a quarter of the record and more, answers inputs that nobody knows.

    The search that follows tells the delay to a sample.
    """
    for seed in range(3):
        (found,) = answers(record(seed, late, hold))
        assert found == pytest.approx(late, abs=5)


@pytest.mark.parametrize("fault", ["none", "saturation", "walk", "load", "cycle", "input without effect"])
def test_what_else_is_wrong_with_a_record_makes_no_late_answer(fault):
    for seed in range(12):
        rng, samples = np.random.default_rng(100 + seed), 180
        u, y = record(seed, 3, (5, 15, 40)[seed % 3])
        drift = {
            "saturation": np.where(y[:, 0] > 0.3, 0.3 - y[:, 0], 0.0),
            "walk": 0.1 * np.cumsum(rng.standard_normal(samples)),
            "load": 0.8 * (np.arange(samples) > rng.integers(40, 140)),
            "cycle": 0.5 * np.sin(np.arange(samples) / rng.uniform(10.0, 25.0)),
            "input without effect": scipy.signal.lfilter([0.1], [1.0, -0.95], rng.standard_normal(samples))
            - y[:, 0],
        }.get(fault, np.zeros(samples))
        assert answers((u, y + drift[:, None])) == (0,)


def test_of_two_inputs_the_late_one_is_told():
    (u, y), (other, more) = record(1, 60, 15), record(2, 3, 9)
    assert answers((np.hstack([other, u]), y + more)) == (0, pytest.approx(60, abs=2))


def test_records_too_short_for_a_lag_tell_none():
    u, y = record(1, 3, 5)
    assert answers(*[(u[at : at + 30], y[at : at + 30]) for at in range(0, 180, 30)]) == (0,)


@pytest.mark.parametrize("late", [3, 60])
def test_behind_known_inputs_all_that_was_not_seen_is_counted_and_nothing_else(late):
    """Without them the first samples, which the delay holds back, are left out."""
    u = np.repeat(np.random.default_rng(6).choice([-1.0, 1.0], 20), 10)[:, None]
    one = (np.ones(1),)
    B, F = np.append(np.zeros(late), 0.1), np.array([1.0, -0.9])
    model = PolynomialModel(((B,),), one, ((F,),), one, one, np.eye(1))
    y = scipy.signal.lfilter(B, F, u[:, 0])[:, None]
    seen, unseen = [(u[:120], y[:120])], [(u[120:], y[120:] + 1.0)]
    alone, known = fits(model, unseen), fits(model, unseen, before=seen)
    assert known.simulated.shape == known.errors.shape == (80, 1)
    assert known.counted.sum() == 80
    assert alone.counted.sum() == 80 - (late - 1)
    # The level that unseen samples are moved by is estimated from these, not from what was seen.
    np.testing.assert_allclose(known.simulated[late:], y[120 + late :] + 1.0, atol=0.1)
    assert alone.simulation[0] == pytest.approx(100.0)
    # So many of each are left out for a comparison, those before among them.
    assert fits(model, unseen, 100, seen).counted.sum() == 80
    assert fits(model, unseen, 100).counted.sum() == 0
    assert fits(model, unseen, 150, seen).counted.sum() == 50


def test_a_dead_time_of_most_of_what_judges_leaves_it_enough():
    """Inputs are known where the other part ends: of 120 samples only 39 were left to judge."""
    found = explore_records([record(5, 80, 15, samples=300)])
    assert np.sum(found.validation.counted) == 120
    assert found.validation.simulation[0] > 75.0
    assert found.model.plant_at(np.array([1e-6]))[0, 0, 0].real == pytest.approx(1.0, abs=0.1)
    assert found.taken[0].orders.delays == (pytest.approx(81, abs=2),)


@pytest.mark.slow
def test_random_dead_times_of_an_eighth_to_three_tenths_of_the_record_are_found():
    """Of sixteen in noise of 5 and 15 % of the move; at first nine were."""
    found = 0
    for seed in range(16):
        rng = np.random.default_rng(1000 + seed)
        samples, gain, lag = rng.choice([200, 300, 500]), rng.uniform(0.5, 3.0), rng.uniform(3.0, 25.0)
        late, hold = int(rng.uniform(0.12, 0.3) * samples), rng.choice([8, 15, 25])
        u = np.repeat(rng.choice([-1.0, 1.0], 2 * samples // hold + 2), hold)[: 2 * samples]
        pole = np.exp(-1.0 / lag)
        y = scipy.signal.lfilter([0.0] * (late + 1) + [gain * (1.0 - pole)], [1.0, -pole], u)
        y += rng.choice([0.05, 0.15]) * gain * rng.standard_normal(u.size)
        told = explore_records([(u[samples:, None], y[samples:, None])])
        G = told.model.plant_at(np.array([1e-6, 0.5 / lag]))[:, 0, 0]
        truth = gain / (1.0 + 1j * np.array([0.0, 0.5])) * np.exp(-1j * np.array([0.0, 0.5]) / lag * late)
        found += np.all(np.abs(G - truth) < 0.25 * gain)
    assert found >= 13
