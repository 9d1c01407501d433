"""Checks of a loop of any number of channels against brute force in the time domain."""

import numpy as np

from inputdesign_cli.spectrum import FirBasis


def check_information(experiment, from_r, from_e):
    """Check the information against sums over time of gradients (t, k, p, ..) for impulses in r and e."""
    covariance, samples = experiment.model.covariance, experiment.samples
    inverse = np.linalg.inv(covariance)
    noise = np.einsum("tkpm,mn,pq,tlqn->kl", from_e, covariance, inverse, from_e, optimize=True)
    close(experiment.noise_information, samples * noise)
    basis = FirBasis(experiment.inputs, 1)
    maps = basis.integrals(experiment.information_density, experiment.singularities)
    x = np.random.default_rng(0).standard_normal(basis.size)
    c = basis.autocovariances(x)
    # M sums E psi psi^T with E r(t + 1) r(t)^T = c_1: psi(t) = sum_s g(s) r(t - s).
    M = np.einsum("tkpm,mn,pq,tlqn->kl", from_r, c[0], inverse, from_r, optimize=True)
    cross = np.einsum("tkpm,nm,pq,tlqn->kl", from_r[1:], c[1], inverse, from_r[:-1], optimize=True)
    close(np.tensordot(x, maps, axes=1), samples * (M + cross + cross.T))


def check_signals(loop, simulated):
    """Check the signals of several runs against `simulated(model, r, e)`, sample by sample."""
    rng = np.random.default_rng(0)
    r = rng.standard_normal((2, 150, loop.model.inputs))
    e = rng.standard_normal((2, 150, loop.model.outputs))
    y, u = loop.signals(r, e)
    for run in range(2):
        expected = simulated(loop.model, r[run], e[run])
        np.testing.assert_allclose(y[run], expected[0], atol=1e-9)
        np.testing.assert_allclose(u[run], expected[1], atol=1e-9)


def close(found, expected):
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
