"""Simulated records of plants whose structure is known, and models that are written down."""

import numpy as np
import scipy.signal

from inputdesign_cli.plant import ContinuousModel, PolynomialModel, SampledModel


def held(rng, samples, hold=6, levels=(-1.0, 1.0)):
    """Return an input (n,) of random levels, each held for some samples."""
    return np.repeat(rng.choice(levels, samples // hold + 1), hold)[:samples]


def siso(B, F=(1.0,), A=(1.0,), C=(1.0,), D=(1.0,), variance=1.0):
    """Return a polynomial model of one input and one output."""
    rows = [np.array(p, dtype=float) for p in (B, F, A, C, D)]
    return PolynomialModel(
        ((rows[0],),), (rows[2],), ((rows[1],),), (rows[3],), (rows[4],), np.array([[variance]])
    )


def lag(K, T, L, step):
    """Return K exp(-L s) / (T s + 1) behind a hold."""
    plant = ContinuousModel.monic(
        ((np.array([K]),),), ((np.array([1.0, T]),),), np.eye(1), delay=((np.array([L]),),)
    )
    return SampledModel(plant, step)


def with_noise(rng, x, ratio=10.0, pole=0.0):
    """Return signals (n,) with noise of that share of their power, which fades by the pole."""
    v = scipy.signal.lfilter([1.0], [1.0, -pole], rng.standard_normal(x.shape), axis=0)
    return x + np.std(x) / np.sqrt(ratio) * v / np.std(v)


def column(*signals):
    """Return signals (n,) as columns."""
    return tuple(x[:, None] for x in signals)
