import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification.filters import Stream
from inputdesign_cli.identification.predictor import errors_and_gradient, prediction_errors
from tests.support.identification_systems import SYSTEMS, data, row_of


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize("runs", [3, 30])
def test_the_gradient_is_the_finite_difference(name, runs):
    row, theta = row_of(SYSTEMS[name]), SYSTEMS[name].theta
    rng = np.random.default_rng(1)
    u, y = (x[..., 0].T for x in data(name, 60, rng, runs=runs))
    theta = theta * (1 + 0.05 * rng.standard_normal((runs, theta.size)))
    _, psi = errors_and_gradient(row, theta, [u], y)
    for i in range(row.size):
        step = np.zeros(row.size)
        step[i] = 1e-6
        ahead, behind = (prediction_errors(row, theta + s * step, [u], y) for s in (1, -1))
        np.testing.assert_allclose(psi[i], -(ahead - behind) / 2e-6, atol=1e-6 * np.abs(psi[i]).max())


@pytest.mark.parametrize("name", SYSTEMS)
def test_prediction_errors_at_the_truth_are_the_noise(name):
    model = SYSTEMS[name]
    A, C, D = model.A[0], model.C[0], model.D[0]
    rng = np.random.default_rng(2)
    u, e = rng.standard_normal((2, 80))
    y = scipy.signal.lfilter(model.B[0][0], np.convolve(A, model.F[0][0]), u)
    y += scipy.signal.lfilter(C, np.convolve(A, D), e)
    errors = prediction_errors(row_of(model), model.theta[None], [u[:, None]], y[:, None])
    np.testing.assert_allclose(errors[:, 0], e, atol=1e-10)


@pytest.mark.parametrize(("runs", "rows"), [(3, 50), (40, 7), (40, 50)])
def test_filters_of_many_runs_are_lfilter(runs, rows):
    rng = np.random.default_rng(3)
    x = rng.standard_normal((50, runs))
    monic = np.concatenate([np.ones((runs, 1)), 0.3 * rng.standard_normal((runs, 3))], axis=1)
    flow = Stream(rows, 3, runs)
    divided, multiplied = np.empty_like(x), np.empty_like(x)
    for start in range(0, 50, rows):
        flow.advance(min(rows, 50 - start))
        flow.enter("x", x[start : start + rows])
        flow.divide("x/D", "x", monic)
        flow.multiply("D x", "x", monic)
        divided[start : start + rows], multiplied[start : start + rows] = flow.now("x/D"), flow.now("D x")
    for run in range(runs):
        by_hand = scipy.signal.lfilter([1.0], monic[run], x[:, run])
        np.testing.assert_allclose(divided[:, run], by_hand, atol=1e-12)
        by_hand = scipy.signal.lfilter(monic[run], [1.0], x[:, run])
        np.testing.assert_allclose(multiplied[:, run], by_hand, atol=1e-12)
