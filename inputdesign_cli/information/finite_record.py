"""Compute the information matrix of a finite record itself, not of the spectrum it was drawn from."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information.experiment import Experiment, PowerKind
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.filtering import filtered

_FORGOTTEN = 32.0  # a response that has decayed by e^-32 is below rounding
_LONGEST_MEMORY = 2**20  # samples; the memory of a plant is cut there
# The longest transform, in records. A longer memory is damped by weights, which raise rounding by up to e^8.
_RECORDS = 4
# Cached records: a delivered record is evaluated for its search, its accuracy, its curves and its start.
_RECENT = 4
_FREQUENCIES_AT_ONCE = 16384
# Gradients with more entries than this are computed anew for each record, a part at a time.
_KEPT = 2**22
Filter = tuple[Array, Array]  # numerator and denominator, ascending in q^-1


@dataclass(frozen=True)
class RecordTransforms:
    """Filters records of `samples` samples by FFT, padded past the memory of the plant or its loop.

    In discrete time, and with integrators, a long memory decays within a padding of three records: samples
    are weighted with e^(-rho t), responses with e^(rho t). In continuous time the plant is driven by the
    band-limited interpolation of the samples, `step` apart, and its outputs are read at the same instants.

    Several experiments share the transforms: their channels stand one after the other.
    """

    experiments: tuple[Experiment, ...]
    samples: int
    step: float

    @property
    def experiment(self) -> Experiment:
        """Return the first of the experiments, which alone has a gradient here."""
        return self.experiments[0]

    def signals(self, of: PowerKind, record: Array) -> Array:
        """Return the response of inputs or outputs to the samples (.., n, r) alone, (.., n, channels)."""
        answer = np.einsum("ncr,...nr->...nc", self._responses(of), self._transform(record))
        return self._back(answer, 1)

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals`, applied to weights (n, channels), (n, r)."""
        falling = self._weights[:, None]
        transform = np.fft.rfft(weights / falling, self._length, axis=0)
        answer = np.einsum("ncr,nc->nr", self._responses(of).conj(), transform)
        return falling * np.fft.irfft(answer, self._length, axis=0)[: self.samples]

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi (.., n, k, p) of the prediction, in these coordinates, noise whitened to I."""
        transform = self._transform(record)
        model = self.experiment.model
        frequencies = transform.shape[-2]
        if self.experiment.size * model.outputs * model.inputs * frequencies <= _KEPT:
            return self._back(np.einsum("nkpr,...nr->...nkp", self._gradient, transform), 2)
        parts = []
        for start in range(0, frequencies, _FREQUENCIES_AT_ONCE):
            part = slice(start, start + _FREQUENCIES_AT_ONCE)
            F = self.experiment.excitation_gradient(self._frequencies[part])
            parts.append(np.einsum("nkpr,...nr->...nkp", F, transform[..., part, :]))
        return self._back(np.concatenate(parts, axis=-3), 2)

    def _transform(self, record: Array) -> ComplexArray:
        """Return the Fourier transform (.., frequencies, r) of the samples (.., n, r), weighted."""
        return np.fft.rfft(record * self._weights[:, None], self._length, axis=-2)

    def _back(self, transform: ComplexArray, behind: int) -> NDArray[np.float64]:
        """Return the samples of a transform, freed of their weights; `behind` axes follow the frequencies."""
        found = np.fft.irfft(transform, self._length, axis=-1 - behind)
        first = np.moveaxis(np.moveaxis(found, -1 - behind, 0)[: self.samples], 0, -1 - behind)
        return first / self._weights.reshape(-1, *(1 for _ in range(behind)))

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
        """Return whether some plant or loop has a pole at frequency zero, where responses are infinite."""
        distances = [np.min(np.abs(one.singularities), initial=1.0) for one in self.experiments]
        return float(min(distances)) < 1e-9

    @cached_property
    def _padded(self) -> int:
        """Return a length past the memory of the plants, a power of two."""
        memory = 0.0
        for one in self.experiments:
            unit = self.step if one.model.continuous else 1.0
            damping = float(np.min(one.singularities.imag, initial=1.0)) * unit
            memory = max(memory, _FORGOTTEN / max(damping, 1e-9) + one.memory / unit)
        return int(2 ** np.ceil(np.log2(self.samples + min(int(np.ceil(memory)), _LONGEST_MEMORY))))

    @cached_property
    def _frequencies(self) -> Array | ComplexArray:
        w = 2.0 * np.pi * np.arange(self._length // 2 + 1) / self._length
        unit = self.step if self.experiment.model.continuous else 1.0
        return np.asarray(w - 1j * self._decay, dtype=complex) / unit if self._decay else w / unit

    @cached_property
    def _kept(self) -> dict[PowerKind, ComplexArray]:
        return {}

    def _responses(self, of: PowerKind) -> ComplexArray:
        """Return the responses (n, channels of all experiments, r) at all frequencies of the transform."""
        if of not in self._kept:
            responses = [one.response(of, self._frequencies) for one in self.experiments]
            self._kept[of] = np.concatenate(responses, axis=1)
        return self._kept[of]

    @cached_property
    def _gradient(self) -> ComplexArray:
        return self.experiment.excitation_gradient(self._frequencies)


@dataclass(frozen=True)
class RecordFilters:
    """Filters records of one channel in q^-1 by difference equations; `model` is the experiment's model.

    The responses equal the ones of `RecordTransforms`, in a tenth of the time.
    """

    experiment: Experiment
    model: PolynomialModel

    @classmethod
    def of(cls, experiment: Experiment) -> RecordFilters | None:
        """Return the filters of an experiment, or None unless its model is polynomial, single-channel."""
        model = experiment.model
        if not isinstance(model, PolynomialModel) or model.inputs > 1 or model.outputs > 1:
            return None
        return cls(experiment, model)

    def signals(self, of: PowerKind, record: Array) -> Array:
        """Return the response of the input or the output to the samples (.., n, 1) alone, in their shape."""
        numerator, denominator = self._responses[of]
        return filtered(numerator, denominator, record, axis=-2)

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals` (n, 1): the same filter, run backwards in time."""
        return self.signals(of, weights[::-1])[::-1]

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi (.., n, k, 1) of the prediction, in these coordinates, noise whitened to 1."""
        sources, samples = self._sources(record), record.shape[-2]
        raw = np.zeros((*record.shape[:-1], self.experiment.size))
        for column, parameter in enumerate(self.model.parameters):
            if parameter.letter in sources and parameter.power < samples:
                moved = sources[parameter.letter][..., : samples - parameter.power]
                raw[..., parameter.power :, column] = moved
        return (raw @ self._whitener)[..., None]

    @cached_property
    def _whitener(self) -> Array:
        """Return the matrix (k, k) from raw rows to these coordinates, noise whitened to 1."""
        return self.experiment.from_raw.T / np.sqrt(self.model.covariance[0, 0])

    @cached_property
    def _responses(self) -> dict[PowerKind, Filter]:
        """Return the filters from the excitation to each kind of signal."""
        m, loop, one = self.model, self.experiment.loop, np.ones(1)
        B, AF = m.B[0][0], np.convolve(m.A[0], m.F[0][0])
        if loop is None:
            return {"excitation": (one, one), "input": (one, one), "output": (B, AF)}
        P, Q = loop.controller.numerator[0, 0], loop.controller.denominator[0]
        around = np.polynomial.polynomial.polyadd(np.convolve(AF, Q), np.convolve(B, P))
        characteristic = np.asarray(around, dtype=np.float64)
        return {
            "excitation": (one, one),
            "input": (np.convolve(AF, Q), characteristic),
            "output": (np.convolve(B, Q), characteristic),
        }

    def _sources(self, record: Array) -> dict[str, Array]:
        """Return the gradient with respect to a coefficient of A, B or F, but for its delay, (.., n).

        It is minus the derivative of the prediction error epsilon = (D / C) (A y - (B / F) u). Filters run
        one after the other: a double pole in one product of their denominators costs half the digits.
        """
        m, letters = self.model, self.model.letters
        B, C, D, F = m.B[0][0], m.C[0], m.D[0], m.F[0][0]
        by_b = filtered(D, np.convolve(C, F), self.signals("input", record)[..., 0])
        sources = {"b": by_b}
        if "a" in letters:
            sources["a"] = filtered(-D, C, self.signals("output", record)[..., 0])
        if "f" in letters:
            sources["f"] = filtered(-B, F, by_b)
        return sources


@dataclass(frozen=True)
class FiniteRecord:
    """Computes responses of the plant or its loop, from rest, to `samples` samples of the excitation.

    Args:
        step: time between samples in the unit of time of the experiment's frequencies (1 for rad/sample).
    """

    experiment: Experiment
    samples: int
    step: float = 1.0

    def information(self, record: Array) -> Array:
        """Return M0 + sum_t psi(t) Lambda^-1 psi(t)^T of samples (.., n, r), (.., k, k)."""
        return self.known + self._excited(record)

    def information_of_experiment(self, record: Array) -> Array:
        """Return the information (k, k) of an experiment of full length, extrapolated from the record."""
        share = self.experiment.samples / self.samples
        return self.experiment.baseline_information + share * self._excited(record)

    def _excited(self, record: Array) -> Array:
        """Return the sum over time of psi psi^T, which the experiment remembers of its last records."""
        digest = hashlib.sha256(np.ascontiguousarray(record).data).digest()
        known, key = self.experiment.evaluated, (self.samples, self.step, record.shape, digest)
        if key not in known:
            psi = self.gradient(record)
            flat = psi.swapaxes(-3, -2).reshape(*record.shape[:-2], self.experiment.size, -1)
            while len(known) >= _RECENT:
                del known[next(iter(known))]
            known[key] = np.asarray(flat @ flat.swapaxes(-2, -1))
            known[key].flags.writeable = False
        return known[key]

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi (.., n, k, p) from rest, in these coordinates, noise whitened to I."""
        return self._answers.gradient(record)

    @cached_property
    def known(self) -> Array:
        """Return M0 (k, k), known without any excitation; the noise part is scaled to the samples."""
        share = self.samples / self.experiment.samples
        return self.experiment.prior_information + share * self.experiment.noise_information

    def signals(self, of: PowerKind, record: Array) -> Array:
        """Return the response (.., n, channels) of inputs or outputs to samples (.., n, r), from rest."""
        return record if self._is_record(of) else self._answers.signals(of, record)

    def mean_squares(self, of: PowerKind, record: Array) -> Array:
        """Return the powers of these signals (.., channels)."""
        return np.asarray(np.mean(self.signals(of, record) ** 2, axis=-2))

    def plants_with_own(self, of: PowerKind) -> int:
        """Return the number of plants whose signals differ: one if the signal is the record itself."""
        return 1

    def signals_of_each(self, of: PowerKind, record: Array) -> Array:
        """Return `signals` at every plant, side by side, or once if the signal is the record itself."""
        return self.signals(of, record)

    def mean_squares_of_each(self, of: PowerKind, record: Array) -> NDArray[np.float64]:
        """Return the powers (plants, channels) at every plant, or once if the signal is the record itself."""
        powers = np.mean(self.signals_of_each(of, record) ** 2, axis=0)
        return np.asarray(powers.reshape(self.plants_with_own(of), -1))

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals`, applied to weights (n, channels), (n, r)."""
        return weights if self._is_record(of) else self._answers.adjoint(of, weights)

    def adjoint_of_each(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals_of_each`, applied to weights (n, columns), (n, r)."""
        return self.adjoint(of, weights)

    def _is_record(self, of: PowerKind) -> bool:
        """Return whether a signal is the excitation itself."""
        return of == "excitation" or (of == "input" and self.experiment.loop is None)

    @cached_property
    def _answers(self) -> RecordFilters | RecordTransforms:
        filters = RecordFilters.of(self.experiment)
        return filters or RecordTransforms((self.experiment,), self.samples, self.step)


@dataclass(frozen=True)
class FiniteRecords(FiniteRecord):
    """Evaluates a record at several plants at once; information matrices are stacked.

    Signals are computed at the first plant, which `experiment` has; the `others` follow it.
    """

    others: tuple[Experiment, ...] = ()

    def information(self, record: Array) -> NDArray[np.float64]:
        """Return the information of each plant as in `FiniteRecord` (1 + others, .., k, k)."""
        return np.array([plant.information(record) for plant in self._each])

    @cached_property
    def known(self) -> NDArray[np.float64]:
        """Return the information of each plant as in `FiniteRecord` (1 + others, k, k)."""
        return np.array([plant.known for plant in self._each])

    @cached_property
    def _each(self) -> list[FiniteRecord]:
        """Return one `FiniteRecord` for every plant, the first for the plant of `experiment`."""
        plants = (self.experiment, *self.others)
        return [FiniteRecord(plant, self.samples, self.step) for plant in plants]

    def signals_of_each(self, of: PowerKind, record: Array) -> Array:
        """Return `signals` at every plant, side by side, or once if the signal is the record itself."""
        if self._is_record(of):
            return record
        return np.concatenate([one.signals(of, record) for one in self._together], axis=1)

    def adjoint_of_each(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals_of_each`, applied to weights (n, columns), (n, r)."""
        if self._is_record(of):
            return weights
        parts = np.split(weights, len(self._together), axis=1)
        each = zip(self._together, parts, strict=True)
        return np.asarray(sum(one.adjoint(of, part) for one, part in each))

    def plants_with_own(self, of: PowerKind) -> int:
        """Return the number of plants whose signals differ: one if the signal is the record itself."""
        return 1 if self._is_record(of) else 1 + len(self.others)

    @cached_property
    def _together(self) -> list[RecordFilters | RecordTransforms]:
        """Return the filters of each plant, or the transforms that all of them share."""
        plants = (self.experiment, *self.others)
        filters = [one for one in map(RecordFilters.of, plants) if one is not None]
        return (
            [*filters] if len(filters) == len(plants) else [RecordTransforms(plants, self.samples, self.step)]
        )
