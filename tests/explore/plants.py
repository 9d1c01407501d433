"""Simulated records of plants whose structure is known."""

import numpy as np
import scipy.signal


def held(rng, samples, hold=6, levels=(-1.0, 1.0)):
    """Return an input (n,) of random levels, each held for some samples."""
    return np.repeat(rng.choice(levels, samples // hold + 1), hold)[:samples]


def with_noise(rng, x, ratio=10.0, pole=0.0):
    """Return signals (n,) with first-order noise at this ratio of powers, signal to noise."""
    v = scipy.signal.lfilter([1.0], [1.0, -pole], rng.standard_normal(x.shape), axis=0)
    return x + np.std(x) / np.sqrt(ratio) * v / np.std(v)


def column(*signals):
    """Return signals (n,) as columns."""
    return tuple(x[:, None] for x in signals)
