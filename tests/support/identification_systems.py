"""Models of one channel of every kind with parameters, and data from them."""

import numpy as np
import scipy.signal

from inputdesign_cli.plant import PolynomialModel
from tests.support.plants import arrays


def one_channel(B, A=(1,), C=(1,), D=(1,), F=(1,), variance=0.5):
    """A model with one input and one output."""
    (A, C, D), covariance = arrays([[A, C, D]])[0], np.array([[variance]])
    return PolynomialModel(arrays([[B]]), (A,), arrays([[F]]), (C,), (D,), covariance)


SYSTEMS = {
    "arx": one_channel([0, 1.0, 0.5], A=[1, -1.5, 0.7]),
    "armax": one_channel([0, 1.0, 0.5], A=[1, -1.5, 0.7], C=[1, 0.6]),
    "oe": one_channel([0, 1.0, 0.5], F=[1, -1.5, 0.7]),
    "bj": one_channel([0, 1.0, 0.5], C=[1, 0.6], D=[1, -0.8], F=[1, -1.5, 0.7]),
    "ararmax": one_channel([0, 0, 1.0, 0.5], A=[1, -1.5, 0.7], C=[1, 0.6], D=[1, -0.8]),
    "full": one_channel([0.4, 1.0, 0.5], A=[1, -0.9], C=[1, 0.6], D=[1, 0.5], F=[1, -0.3]),
}


def data(name, samples, rng, runs=1):
    """u, y (runs, samples, 1) with unit white input and noise of variance 0.5."""
    model = SYSTEMS[name]
    A, C, D = model.A[0], model.C[0], model.D[0]
    u = rng.standard_normal((runs, samples))
    e = np.sqrt(0.5) * rng.standard_normal((runs, samples))
    y = scipy.signal.lfilter(model.B[0][0], np.convolve(A, model.F[0][0]), u)
    y += scipy.signal.lfilter(C, np.convolve(A, D), e)
    return u[..., None], y[..., None]
