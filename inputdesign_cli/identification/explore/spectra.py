"""A frequency response without a structure, with confidence: smoothed spectra ([ljung-1999], Section 6.4).

Welch's averages over overlapping segments with a Hann window. With K independent averages the variance of
an entry of G is, as for a regression on the inputs, Phi_v (Phi_u^-1)_jj / K.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array

_SEGMENTS = 8
_LONGEST = 4096
# Of segments that overlap by half with a Hann window about so many in nine are independent.
_INDEPENDENT = 8.0 / 9.0
_FAINT = 1e-6


@dataclass(frozen=True)
class FrequencyResponse:
    """At frequencies w (n,) in rad/sample.

    Attributes:
        response: G (n, p, r); NaN where the inputs have no power.
        deviation: (n, p, r) standard deviation of |G|, each of its two parts having 1/2 of the variance.
        input, noise: spectra (n, r) and (n, p).
        coherence: (n, p) the share of the spectrum of y that the inputs explain.
    """

    w: Array
    response: NDArray[np.complex128]
    deviation: NDArray[np.float64]
    input: NDArray[np.float64]
    noise: NDArray[np.float64]
    coherence: NDArray[np.float64]


def frequency_response(parts: Sequence[tuple[Array, Array]]) -> FrequencyResponse:
    """Of records u (N, r), y (N, p), their means and lines taken away."""
    longest = max(len(y) for _, y in parts)
    total = sum(len(y) for _, y in parts)
    length = int(2 ** np.floor(np.log2(np.clip(2 * total / _SEGMENTS, 8, min(longest, _LONGEST)))))
    window = scipy.signal.get_window("hann", length)
    r = parts[0][0].shape[1]
    transforms = []
    for u, y in parts:
        both = scipy.signal.detrend(np.column_stack([u, y]), axis=0)
        for begin in range(0, len(both) - length + 1, length // 2):
            transforms.append(np.fft.rfft(window[:, None] * both[begin : begin + length], axis=0))
    X = np.array(transforms) / np.sqrt(np.sum(window**2))
    phi = np.einsum("kna,knb->nab", X, X.conj()) / len(X)
    averages = max(len(X) * (_INDEPENDENT if len(X) > 1 else 1.0), 1.0)
    uu, yu, yy = phi[:, :r, :r], phi[:, r:, :r], np.einsum("naa->na", phi[:, r:, r:]).real
    scale = np.sqrt(np.maximum(np.einsum("naa->na", uu).real, 1e-300))
    power = np.mean(scale**2, axis=0)
    normal = uu / (scale[:, :, None] * scale[:, None, :])
    apart = np.linalg.eigvalsh(normal)[:, 0] > 0.25 / averages
    excited = np.all(scale**2 > _FAINT * power, axis=1) & apart
    response = np.full(yu.shape, np.nan + 0j)
    deviation = np.full(yu.shape, np.nan)
    noise, coherence = yy.copy(), np.full(yy.shape, np.nan)
    freedom = averages - r
    for n in np.flatnonzero(excited & (freedom > 0)):
        inverse = np.linalg.inv(uu[n])
        response[n] = yu[n] @ inverse
        explained = np.einsum("pr,pr->p", response[n], yu[n].conj()).real
        noise[n] = np.maximum(yy[n] - explained, 0.0) * averages / freedom
        coherence[n] = np.clip(explained / np.maximum(yy[n], 1e-300), 0.0, 1.0)
        deviation[n] = np.sqrt(np.outer(noise[n], np.diag(inverse).real) / averages)
    kept = slice(1, None)
    w = 2.0 * np.pi * np.arange(length // 2 + 1) / length
    spectrum = np.einsum("naa->na", uu).real
    return FrequencyResponse(
        w[kept], response[kept], deviation[kept], spectrum[kept], noise[kept], coherence[kept]
    )
