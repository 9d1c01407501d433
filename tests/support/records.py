"""Simulated records of plants with several channels."""

import numpy as np
import scipy.signal


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
