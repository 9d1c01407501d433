"""Dead times that may lie on either side of a sampling instant: what the covariance says of them."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.processes import Process, process_models
from inputdesign_cli.identification import identify


def answer(u, lag, late):
    """Samples of the answer of exp(-late s) / (lag s + 1) to an input that is held for a unit of time."""
    whole = int(np.floor(late))
    pole, left = np.exp(-1.0 / lag), np.exp(-(1.0 - (late - whole)) / lag)
    return scipy.signal.lfilter(np.r_[np.zeros(whole + 1), 1.0 - left, left - pole], [1.0, -pole], u)


def estimated(truth, u, y, *, noise=0, rest=None):
    model = process_models([Process((1,), 1, 1.0, noise=noise)], [truth], np.eye(1))
    return identify(model, u[:, None], y[:, None], start=truth, rest=rest, near=True)


def moved(seed):
    """Seven moves of the input of a lag, and white noise: the record, and its log likelihood on a grid.

    The gain is integrated out exactly, and the variance of the noise is that of what is left.
    """
    rng = np.random.default_rng(seed)
    u = np.repeat([0.0, 1.0, -1.0, 0.0, 1.0, 0.0, -1.0, -1.0], 15)
    y = 2.0 * answer(u, 4.0, 2.5) + 0.35 * rng.standard_normal(u.size)
    lags, lates = np.linspace(1.0, 10.0, 73), np.linspace(0.02, 6.0, 200)
    log = np.empty((lags.size, lates.size))
    for i, lag in enumerate(lags):
        for j, late in enumerate(lates):
            x = answer(u, lag, late)
            left = y @ y - (x @ y) ** 2 / (x @ x)
            log[i, j] = -0.5 * y.size * np.log(left) - 0.5 * np.log(x @ x)
    return u, y, lags, lates, log


@pytest.mark.first(2)
@pytest.mark.parametrize("seed", [7, 14, 20, 37])
def test_deviations_are_those_of_the_likelihood_beyond_instants(seed):
    """The curvature at the best minimum alone has dead times by a third to a half too sure here."""
    u, y, lags, lates, log = moved(seed)
    estimate = estimated(np.array([2.0, 4.0, 2.5]), u, y, rest=True)
    weights = np.exp(log - log.max())
    weights /= weights.sum()
    squares = (lags[:, None] - estimate.theta[1]) ** 2, (lates[None] - estimate.theta[2]) ** 2
    integrated = [np.sqrt(np.sum(weights * square)) for square in squares]
    told = np.sqrt(np.diag(estimate.covariance))[1:]
    np.testing.assert_allclose(told, integrated, rtol=0.15)


def test_the_best_minimum_is_found_from_any_sample_beside():
    """There is another one, hardly less likely, at 2.75."""
    u, y, _, lates, log = moved(20)
    best = lates[np.argmax(log.max(axis=0))]
    for start in (0.4, 1.5, 2.5, 3.5, 4.4):
        estimate = estimated(np.array([2.0, 4.0, start]), u, y, rest=True)
        assert estimate.theta[2] == pytest.approx(best, abs=0.05), start


@pytest.mark.slow
def test_the_covariance_of_dead_times_is_that_of_their_errors():
    """Bumps in noise with a memory: 95 % of estimates within 1.96 deviations; binomial scatter is 2 %."""
    u = np.repeat([0.0, 5.0, -5.0, 0.0, 5.0, 0.0, -5.0, -5.0], 30)
    away = []
    for seed in range(120):
        rng = np.random.default_rng(seed)
        truth = np.array([rng.uniform(0.5, 3.0), rng.uniform(6.0, 20.0), rng.uniform(1.0, 8.0), 0.0, -0.7])
        noise = scipy.signal.lfilter([1.0], [1.0, -0.7], rng.standard_normal(u.size + 100))[100:]
        y = truth[0] * (answer(u, *truth[1:3]) + 0.18 * noise)
        estimate = estimated(truth, u, y, noise=1, rest=False)
        away.append(((estimate.theta - truth) / np.sqrt(np.diag(estimate.covariance)))[:3])
    within = np.mean(np.abs(away) < 1.96, axis=0)
    assert np.all(within > 0.95 - 0.055), within
