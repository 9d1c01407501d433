"""Models of one channel of every kind with parameters, and data from them."""

from functools import partial

from inputdesign_cli.plant import PolynomialModel
from tests.support.records import simulated

one_channel = partial(PolynomialModel.single, variance=0.5)
SYSTEMS = {
    "arx": one_channel([0, 1.0, 0.5], A=[1, -1.5, 0.7]),
    "armax": one_channel([0, 1.0, 0.5], A=[1, -1.5, 0.7], C=[1, 0.6]),
    "oe": one_channel([0, 1.0, 0.5], F=[1, -1.5, 0.7]),
    "bj": one_channel([0, 1.0, 0.5], C=[1, 0.6], D=[1, -0.8], F=[1, -1.5, 0.7]),
    "ararmax": one_channel([0, 0, 1.0, 0.5], A=[1, -1.5, 0.7], C=[1, 0.6], D=[1, -0.8]),
    "full": one_channel([0.4, 1.0, 0.5], A=[1, -0.9], C=[1, 0.6], D=[1, 0.5], F=[1, -0.3]),
}


def data(name, samples, rng, runs=1):
    """u, y (runs, samples, 1) with unit white input."""
    return simulated(SYSTEMS[name], samples, rng, runs)
