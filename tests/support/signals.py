"""Spectra of signals, and periodograms of records."""

import numpy as np

from inputdesign_cli.signal.spectral_factor import autocorrelation

COLOURED = autocorrelation(np.array([1.0, 0.9, 0.6, 0.3]))


def of_two_inputs(w):
    """A moving average of three taps at each of two inputs, correlated with a phase that turns."""
    phi = np.zeros((w.size, 2, 2), dtype=complex)
    for tap, phase in ((1.0, 0), (0.5, 1)):
        h = tap * np.exp(-1j * np.outer(w, [phase, 2 * phase])) @ np.array([[1.0, 0.2], [0.4, 3.0]])
        phi += h[:, :, None] * h[:, None, :].conj()
    return phi + 0.2 * np.eye(2)


def periodogram(x):
    power = np.abs(np.fft.rfft(x) / x.size) ** 2
    power[1 : (x.size + 1) // 2] *= 2
    return power


def block_spectrum(record, blocks):
    """The mean over blocks of the matrix periodogram (n, r, r)."""
    period = len(record) // blocks
    X = np.fft.rfft(record.reshape(blocks, period, -1), axis=1) / np.sqrt(period)
    return np.einsum("bni,bnj->nij", X, X.conj()) / blocks
