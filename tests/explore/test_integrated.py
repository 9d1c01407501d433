"""Outputs that wander as random walks do, beside a plant that is moved by steps."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats
from hypothesis import given, settings, strategies as st

from inputdesign_cli.explore import explore_records, fits
from inputdesign_cli.explore.integrated import differenced, integrating, like_random_walks
from inputdesign_cli.plant import PolynomialModel

GAIN, LAG, LATE = 2.0, 9.0, 2.3


def steps(samples=300, every=35):
    return np.resize(np.repeat([0.0, 1.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0], every), samples)


def lagged(u, finer=20):
    """The answer of a lag behind a dead time, on a finer grid."""
    fine = np.concatenate([np.zeros(round(LATE * finer)), np.repeat(u, finer)])[: u.size * finer]
    pole = np.exp(-1.0 / finer / LAG)
    return GAIN * scipy.signal.lfilter([0.0, 1.0 - pole], [1.0, -pole], fine)[::finer]


def walk(rng, samples, size):
    return size * np.cumsum(rng.standard_normal(samples))


def polynomials(pole=0.9, c=-0.3):
    one = (np.ones(1),)
    B, F = np.array([0.0, 0.2]), np.array([1.0, -pole])
    return PolynomialModel(((B,),), one, ((F,),), (np.array([1.0, c]),), one, np.eye(1))


@pytest.mark.slow
def test_gains_are_told_beside_random_walks():
    """Output-error models took the walk for slow modes of the plant, once with a gain of the wrong sign.

    By chance a level may be likelier than a walk, and one of many tests refuse a right model: once in six.
    """
    deviations, wander, refused = [], 0, 0
    for seed in range(2, 8):
        rng = np.random.default_rng(seed)
        u = steps()
        y = lagged(u) + walk(rng, u.size, 0.06) + 0.04 * rng.standard_normal(u.size)
        found = explore_records([(u[:, None], y[:, None])])
        wander += found.wanders == (True,)
        refused += bool(found.estimate.failed)
        slow = np.array([1e-6])
        gain, slope = (f(slow)[0, ..., 0, 0].real for f in (found.model.plant_at, found.model.plant_gradient))
        deviations.append((gain - GAIN) / np.sqrt(slope @ found.estimate.covariance @ slope))
    assert wander >= 5
    assert refused <= 1
    assert np.sum(np.square(deviations)) < scipy.stats.chi2.ppf(0.999, len(deviations))


def test_walks_and_noise_about_levels_are_told_apart():
    """Of 40 each, in three records: what a unit root leaves is beyond a twentieth of the likelihood."""
    rng = np.random.default_rng(1)
    kinds = {True: ([1.0], [1.0, -1.0]), False: ([1.0], [1.0, -0.5])}
    for walks, (above, below) in kinds.items():
        made = [
            [
                5.0 + scipy.signal.lfilter(above, below, rng.standard_normal((n, 1)), axis=0)
                for n in (80, 120, 60)
            ]
            for _ in range(40)
        ]
        assert sum(like_random_walks(left) == [walks] for left in made) >= 38


@given(
    pole=st.floats(-0.9, 0.95),
    c=st.floats(-0.9, 0.9),
    level=st.floats(-100.0, 100.0),
    seed=st.integers(0, 99),
)
@settings(max_examples=400, deadline=None)
def test_differences_have_the_plant_of_noise_that_integrates(pole, c, level, seed):
    """Its prediction errors are those that the same model, without the integrator, makes of differences."""
    rng = np.random.default_rng(seed)
    model = polynomials(pole, c)
    u = rng.choice([-1.0, 1.0], (200, 1))
    e = np.cumsum(scipy.signal.lfilter([1.0, c], [1.0], 0.1 * rng.standard_normal(200)))
    y = level + scipy.signal.lfilter([0.0, 0.2], [1.0, -pole], u[:, 0]) + e
    record = [(u, y[:, None])]
    whole = fits(integrating(model, (True,)), record).errors
    steps_alone = fits(model, differenced(record)).errors
    # Starts are estimated along, which die out, and of differences a level.
    whole, steps_alone = (errors[-50:] - errors[-50:].mean() for errors in (whole, steps_alone))
    np.testing.assert_allclose(whole, steps_alone, atol=2e-3)


def test_what_has_no_noise_of_that_kind_is_refused():
    with pytest.raises(TypeError, match="no noise that integrates"):
        integrating(object(), (True,))
