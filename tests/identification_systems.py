"""Structures of every kind with parameters, and data from them."""

import numpy as np
import scipy.signal

from inputdesign_cli.identification import Structure

SYSTEMS = {
    "arx": (Structure(a=2, b=2), [-1.5, 0.7, 1.0, 0.5]),
    "armax": (Structure(a=2, b=2, c=1), [-1.5, 0.7, 1.0, 0.5, 0.6]),
    "oe": (Structure(b=2, f=2), [1.0, 0.5, -1.5, 0.7]),
    "bj": (Structure(b=2, c=1, d=1, f=2), [1.0, 0.5, 0.6, -0.8, -1.5, 0.7]),
    "ararmax": (Structure(a=2, b=3, c=1, d=1, delay=2), [-1.5, 0.7, 1.0, 0.5, 0.6, -0.8]),
    "full": (Structure(a=1, b=2, c=1, d=1, f=1, delay=0), [-0.9, 0.4, 1.0, 0.5, 0.6, 0.5, -0.3]),
}


def data(name, samples, rng, runs=1):
    """u, y (runs, samples) with unit white input and noise of variance 0.5."""
    structure, theta = SYSTEMS[name]
    model = structure.model(np.array(theta), 0.5)
    u = rng.standard_normal((runs, samples))
    e = np.sqrt(0.5) * rng.standard_normal((runs, samples))
    y = scipy.signal.lfilter(model.B, np.convolve(model.A, model.F), u)
    return u, y + scipy.signal.lfilter(model.C, np.convolve(model.A, model.D), e)
