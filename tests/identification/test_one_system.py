"""Experiments of one system and of several: against regressions that give each its own parameters."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import identify
from tests.support.identification_systems import SYSTEMS, one_channel
from tests.support.records import shifted


def recorded(b, samples, seed, spread=1.0):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(samples)
    y = scipy.signal.lfilter([0, b, 0.5], [1, -1.5, 0.7], u)
    return u, y + scipy.signal.lfilter([1], [1, -1.5, 0.7], spread * rng.standard_normal(samples))


def jointly(*records, model=SYSTEMS["arx"]):
    u, y = (np.concatenate(parts)[:, None] for parts in zip(*records, strict=True))
    lengths = [len(record[0]) for record in records]
    return identify(model, u, y, lengths=lengths, experiments=lengths, rest=True)


def test_of_arx_it_is_the_test_of_wald():
    """Two regressions on their own; the noise of each is that which the joint parameters leave."""
    records = [recorded(1.0, 300, 1), recorded(1.1, 200, 2, spread=2.0)]
    found = jointly(*records)
    estimates, variances = [], []
    for u, y in records:
        matrix = np.stack([shifted(-y, 1), shifted(-y, 2), shifted(u, 1), shifted(u, 2)], axis=1)
        left = y - matrix @ found.theta
        estimates.append(np.linalg.lstsq(matrix, y, rcond=None)[0])
        variances.append(np.mean(left**2) * np.linalg.inv(matrix.T @ matrix))
    apart = estimates[0] - estimates[1]
    statistic = apart @ np.linalg.solve(sum(variances), apart)
    assert found.tests.alike == pytest.approx([scipy.stats.chi2.sf(statistic, 4)] * 2, rel=1e-6)


def test_one_experiment_has_nothing_to_differ_from():
    assert jointly(recorded(1.0, 300, 1)).tests.alike == ()


def test_the_one_that_differs_is_the_least_likely():
    records = [recorded(1.0, 300, 1), recorded(1.0, 300, 2), recorded(-1.0, 300, 3)]
    alike = jointly(*records).tests.alike
    assert np.argmin(alike) == 2
    assert alike[2] < 1e-6


@pytest.mark.slow
def test_of_one_system_the_probability_is_uniform():
    model = one_channel([0, 1.0, 0.5], F=[1, -1.5, 0.7])
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = rng.standard_normal((2, 250))
        y = scipy.signal.lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u) + rng.standard_normal((2, 250))
        found.append(jointly(*zip(u, y, strict=True), model=model).tests.alike[0])
    assert scipy.stats.kstest(found, "uniform").pvalue > 1e-3


@pytest.mark.first(4)
@pytest.mark.parametrize("samples", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_a_first_experiment_of_few_samples_changes_nothing(samples, seed):
    """It has no information in most directions, exactly none in some."""
    u, y = recorded(1.0, 200, seed)
    with np.errstate(all="raise", under="ignore"):
        found = identify(
            SYSTEMS["arx"], u[:, None], y[:, None], experiments=[samples, 200 - samples], rest=True
        )
    matrix = np.stack([shifted(-y, 1), shifted(-y, 2), shifted(u, 1), shifted(u, 2)], axis=1)
    np.testing.assert_allclose(found.theta, np.linalg.lstsq(matrix, y, rcond=None)[0], rtol=1e-6)
    assert np.all(np.array(found.tests.alike) > 0.01)
