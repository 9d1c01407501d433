"""The response of any model or loop to a finite record from rest, by Fourier transforms."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information.experiment import Experiment, PowerKind

# e^-32 is below rounding; a plant that remembers longer than this many samples is cut there.
_FORGOTTEN = 32.0
_LONGEST_MEMORY = 2**20
# A longer memory than this many records is weighted down instead; rounding grows to e^8 of itself.
_RECORDS = 4
_FREQUENCIES_AT_ONCE = 16384
# Frequency responses of more numbers than this are computed anew for each record.
_KEPT = 2**22


@dataclass(frozen=True)
class RecordTransforms:
    """Filters records of `samples` samples by FFT, padded past the memory of the plant or its loop.

    In discrete time a long memory is forgotten within a padding of three records: samples are weighted with
    e^(-rho t), what they cause with e^(rho t). In continuous time the plant is driven by the band-limited
    interpolation of the samples, `step` apart, and its outputs are read at the same instants.
    """

    experiment: Experiment
    samples: int
    step: float

    def signals(self, of: PowerKind, record: Array) -> Array:
        """Return the response of inputs or outputs to the samples (n, r) alone, (n, channels)."""
        answer = np.einsum("ncr,nr->nc", self._responses(of), self._transform(record))
        return self._back(answer)

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals`, applied to weights (n, channels), (n, r)."""
        falling = self._weights[:, None]
        transform = np.fft.rfft(weights / falling, self._length, axis=0)
        answer = np.einsum("ncr,nc->nr", self._responses(of).conj(), transform)
        return falling * np.fft.irfft(answer, self._length, axis=0)[: self.samples]

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi (n, k, p), the gradient of the prediction, in these coordinates, noise whitened to I."""
        transform = self._transform(record)
        model = self.experiment.model
        if self.experiment.size * model.outputs * model.inputs * len(transform) <= _KEPT:
            return self._back(np.einsum("nkpr,nr->nkp", self._gradient, transform))
        parts = []
        for start in range(0, len(transform), _FREQUENCIES_AT_ONCE):
            part = slice(start, start + _FREQUENCIES_AT_ONCE)
            F = self.experiment.excitation_gradient(self._frequencies[part])
            parts.append(np.einsum("nkpr,nr->nkp", F, transform[part]))
        return self._back(np.concatenate(parts))

    def _transform(self, record: Array) -> ComplexArray:
        """Return the Fourier transform (frequencies, r) of the samples (n, r), weighted."""
        return np.fft.rfft(record * self._weights[:, None], self._length, axis=0)

    def _back(self, transform: ComplexArray) -> NDArray[np.float64]:
        """Return (n, ..) samples of a transform (frequencies, ..) of weighted ones."""
        weights = self._weights.reshape(-1, *(1 for _ in transform.shape[1:]))
        return np.fft.irfft(transform, self._length, axis=0)[: self.samples] / weights

    @cached_property
    def _weights(self) -> Array:
        """Return e^(-rho t), as (n,)."""
        return np.exp(-self._decay * np.arange(self.samples))

    @cached_property
    def _decay(self) -> float:
        """Return rho, zero where the padding outlasts the memory."""
        outlasts = self._padded == self._length and not self._integrates
        return 0.0 if outlasts else _FORGOTTEN / self._length

    @cached_property
    def _length(self) -> int:
        if self.experiment.model.continuous and not self._integrates:
            return self._padded
        return min(self._padded, int(2 ** np.ceil(np.log2(_RECORDS * self.samples))))

    @property
    def _integrates(self) -> bool:
        """Return whether there is no response at frequency zero."""
        return float(np.min(np.abs(self.experiment.singularities), initial=1.0)) < 1e-9

    @cached_property
    def _padded(self) -> int:
        """Return a length past the memory of the plant, a power of two."""
        experiment = self.experiment
        damping = float(np.min(experiment.singularities.imag, initial=1.0)) * (
            self.step if experiment.model.continuous else 1.0
        )
        further = experiment.memory / (self.step if experiment.model.continuous else 1.0)
        memory = min(int(np.ceil(_FORGOTTEN / max(damping, 1e-9) + further)), _LONGEST_MEMORY)
        return int(2 ** np.ceil(np.log2(self.samples + memory)))

    @cached_property
    def _frequencies(self) -> Array | ComplexArray:
        w = 2.0 * np.pi * np.arange(self._length // 2 + 1) / self._length
        unit = self.step if self.experiment.model.continuous else 1.0
        return np.asarray(w - 1j * self._decay, dtype=complex) / unit if self._decay else w / unit

    @cached_property
    def _kept(self) -> dict[PowerKind, ComplexArray]:
        return {}

    def _responses(self, of: PowerKind) -> ComplexArray:
        """Return the responses (n, channels, r) at all frequencies of the transform."""
        if of not in self._kept:
            self._kept[of] = self.experiment.response(of, self._frequencies)
        return self._kept[of]

    @cached_property
    def _gradient(self) -> ComplexArray:
        return self.experiment.excitation_gradient(self._frequencies)
