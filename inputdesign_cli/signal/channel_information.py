"""What a finite record of several inputs achieves: its own information matrix and outputs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.information import ChannelExperiment, PowerKind
from inputdesign_cli.plant.polynomial import Array, ComplexArray

# e^-32 is below rounding; a plant that remembers longer than this many samples is cut there.
_FORGOTTEN = 32.0
_LONGEST_MEMORY = 2**20
_FREQUENCIES_AT_ONCE = 16384
# Frequency responses of more numbers than this are computed anew for each record.
_KEPT = 2**22


@dataclass(frozen=True)
class RecordFilter:
    """The plant or its loop, from rest, as it answers records of `samples` samples of the excitation.

    Filtering is by FFT, padded past memory. In continuous time the plant is driven by the band-limited
    interpolation of the samples, `step` apart, and its outputs are read at the same instants.
    """

    experiment: ChannelExperiment
    samples: int
    step: float

    def information(self, record: Array) -> Array:
        """(k, k): M0 + sum_t psi(t) Lambda^-1 psi(t)^T of the samples (n, r), M0 scaled to n."""
        psi = self._prediction_gradient(record)
        flat = psi.transpose(1, 0, 2).reshape(self.experiment.size, -1)
        noise = self.samples / self.experiment.samples * self.experiment.noise_information
        return self.experiment.prior_information + noise + flat @ flat.T

    def signals(self, of: PowerKind, record: Array) -> Array:
        """(n, channels): what the samples (n, r) alone cause at inputs or outputs."""
        if self._is_record(of):
            return record
        transform = np.fft.rfft(record, self._length, axis=0)
        answer = np.einsum("ncr,nr->nc", self._responses(of), transform)
        return np.asarray(np.fft.irfft(answer, self._length, axis=0)[: self.samples])

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """(n, r): the transpose of `signals`, applied to weights (n, channels)."""
        if self._is_record(of):
            return weights
        transform = np.fft.rfft(weights, self._length, axis=0)
        answer = np.einsum("ncr,nc->nr", self._responses(of).conj(), transform)
        return np.asarray(np.fft.irfft(answer, self._length, axis=0)[: self.samples])

    def _is_record(self, of: PowerKind) -> bool:
        """Whether a signal is the excitation itself."""
        return of == "excitation" or (of == "input" and self.experiment.loop is None)

    @cached_property
    def _length(self) -> int:
        experiment = self.experiment
        damping = float(np.min(experiment.singularities.imag, initial=1.0)) * (
            self.step if experiment.model.continuous else 1.0
        )
        memory = min(int(np.ceil(_FORGOTTEN / max(damping, 1e-9))), _LONGEST_MEMORY)
        return int(2 ** np.ceil(np.log2(self.samples + memory)))

    @cached_property
    def _frequencies(self) -> Array:
        w = 2.0 * np.pi * np.arange(self._length // 2 + 1) / self._length
        return w / self.step if self.experiment.model.continuous else w

    @cached_property
    def _kept(self) -> dict[PowerKind, ComplexArray]:
        return {}

    def _responses(self, of: PowerKind) -> ComplexArray:
        """(n, channels, r) at all frequencies of the transform."""
        if of not in self._kept:
            self._kept[of] = self.experiment.response(of, self._frequencies)
        return self._kept[of]

    @cached_property
    def _gradient(self) -> ComplexArray:
        return self.experiment.excitation_gradient(self._frequencies)

    def _prediction_gradient(self, record: Array) -> NDArray[np.float64]:
        """(n, k, p)."""
        transform = np.fft.rfft(record, self._length, axis=0)
        model = self.experiment.model
        if self.experiment.size * model.outputs * model.inputs * len(transform) <= _KEPT:
            answer = np.einsum("nkpr,nr->nkp", self._gradient, transform)
            return np.fft.irfft(answer, self._length, axis=0)[: len(record)]
        parts = []
        for start in range(0, len(transform), _FREQUENCIES_AT_ONCE):
            part = slice(start, start + _FREQUENCIES_AT_ONCE)
            F = self.experiment.excitation_gradient(self._frequencies[part])
            parts.append(np.einsum("nkpr,nr->nkp", F, transform[part]))
        return np.fft.irfft(np.concatenate(parts), self._length, axis=0)[: len(record)]


def channel_record_information(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(k, k): the information of one record (n, r), see `RecordFilter`."""
    return RecordFilter(experiment, len(record), step).information(record)


def channel_outputs(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(n, p): what the samples alone cause at the outputs, from rest."""
    return RecordFilter(experiment, len(record), step).signals("output", record)


def channel_inputs(experiment: ChannelExperiment, record: Array, step: float) -> Array:
    """(n, r): what the samples alone cause at the inputs; in open loop they are the inputs."""
    return RecordFilter(experiment, len(record), step).signals("input", record)
