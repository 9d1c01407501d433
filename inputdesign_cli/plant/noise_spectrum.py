"""The spectrum of the noise at the outputs, at the harmonics of a period, of any model in discrete time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.plant.model import Model

_FIRST, _LONGEST = 1024, 2**20  # samples of an impulse response
# Share of the energy of an impulse response in its second half up to which it has decayed.
_DECAYED = 1e-24


@dataclass(frozen=True)
class NoiseSpectrum:
    """Holds the responses (p, n, p) of outputs to impulses of independent unit sources, to their end."""

    impulses: Array

    @classmethod
    def of(cls, model: Model) -> NoiseSpectrum:
        """Compute the spectrum of H e of a model in discrete time.

        Raises:
            InaccurateError: `integral-inaccurate` if the impulse response decays too slowly.
        """
        p, length = model.outputs, _FIRST
        root = np.linalg.cholesky(model.covariance)
        while length <= _LONGEST:
            e = np.zeros((p, length, p))
            e[:, 0] = root.T
            found = model.simulate(np.zeros((p, length, model.inputs)), e, 1.0)[1]
            late, all_ = np.sum(found[:, length // 2 :] ** 2), np.sum(found**2)
            if late <= _DECAYED * all_:
                return cls(found)
            length *= 4
        raise InaccurateError.because(
            "integral-inaccurate",
            "the noise hardly forgets: its spectrum at the lines depends on how long it has run",
            hint="move roots of D away from the unit circle; noise that drifts has no such spectrum",
            key="noise",
        )

    def at(self, period: int, harmonics: NDArray[np.int_]) -> Array:
        """Return Phi_v (L, p) at harmonics of a period of `period` samples."""
        return _power(self._folded(self.impulses, period)[:, harmonics])

    def averaged(self, period: int, harmonics: NDArray[np.int_], periods: int) -> Array:
        """Return the mean periodogram E|sum_t v(t) e^{-jwt}|^2 / N of N samples, `periods` periods, (L, p).

        It is Phi_v through the window of a finite record, which Fejer's kernel describes.
        """
        n, samples = self.impulses.shape[1], period * periods
        length = 2 ** int(np.ceil(np.log2(2 * n)))
        r = np.fft.irfft(_power(np.fft.rfft(self.impulses, length, axis=1)), length, axis=0)[:n]
        weighted = r * np.maximum(1.0 - np.arange(n) / samples, 0.0)[:, None]
        found = self._folded(weighted[None], samples)[0, harmonics * periods]
        return np.asarray(2.0 * found.real - r[0])

    @staticmethod
    def _folded(sequence: Array, period: int) -> NDArray[np.complex128]:
        """Return transforms of sequences (.., n, p) at harmonics of a period, (.., period // 2 + 1, p)."""
        *several, n, p = sequence.shape
        padded = np.zeros((*several, -(-n // period) * period, p))
        padded[..., :n, :] = sequence
        return np.fft.rfft(padded.reshape(*several, -1, period, p).sum(axis=-3), axis=-2)


def _power(transforms: NDArray[np.complex128]) -> Array:
    """Return the powers (L, p) of outputs, summed over independent sources, which come first."""
    return np.asarray(np.sum(np.abs(transforms) ** 2, axis=0))
