"""Simulated records, and checks of gradients and estimates from them."""

import numpy as np
import scipy.signal

from inputdesign_cli.identification import identify
from inputdesign_cli.identification.estimators import estimator


def simulated(model, samples, rng, runs=1, power=1.0):
    """u (runs, samples, r), white, and y (runs, samples, p) by the equation of a polynomial model."""
    u = np.sqrt(power) * rng.standard_normal((runs, samples, model.inputs))
    e = rng.standard_normal((runs, samples, model.outputs)) @ np.linalg.cholesky(model.covariance).T
    y = np.zeros((runs, samples, model.outputs))
    for i in range(model.outputs):
        A, C, D = (p[0] if len(p) == 1 else p[i] for p in (model.A, model.C, model.D))
        right = scipy.signal.lfilter(C, D, e[..., i])
        for j in range(model.inputs):
            right = right + scipy.signal.lfilter(model.B[i][j], model.F[i][j], u[..., j])
        y[..., i] = scipy.signal.lfilter([1.0], A, right)
    return u, y


def shifted(x, lag):
    """x(t - lag), zero before the record."""
    return np.concatenate([np.zeros(lag), x[: x.size - lag]])


def arx_regressors(u, y):
    """The regressors (samples, 4) of an ARX model with two coefficients in A and in B."""
    return np.stack([shifted(x, lag) for x in (-y, u) for lag in (1, 2)], axis=1)


def check_record(model, samples):
    """psi of a record with noise by differences of its errors, which at the truth are the noise itself."""
    rng = np.random.default_rng(3)
    u, e = rng.standard_normal((samples, model.inputs)), rng.standard_normal((samples, model.outputs))
    kind, y = estimator(model, 1.0), sum(model.simulate(u, e, 1.0))
    errors, psi = kind.errors_and_gradient(model.theta, u, y)
    np.testing.assert_allclose(errors, e, atol=1e-9)
    for k, step in enumerate(1e-6 * np.eye(model.theta.size)):
        up, down = (kind.errors_and_gradient(model.theta + s * step, u, y)[0] for s in (1, -1))
        np.testing.assert_allclose(psi[k], (down - up) / 2e-6, atol=1e-6 * max(np.abs(psi[k]).max(), 1.0))


def check_estimate(model, u, y, start, **options):
    """The estimate of a model from u (n, r) and y (n, p), within four standard deviations of the truth."""
    found = identify(model, u, y, start=start, **options)
    assert found.search.converged
    assert np.all(np.abs(found.theta - model.theta) < 4.0 * np.sqrt(np.diag(found.covariance)))
    return found
