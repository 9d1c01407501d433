"""Compute the information matrix of a finite record itself, not of the spectrum it was drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.information.experiment import Experiment, PowerKind
from inputdesign_cli.information.record_transforms import RecordTransforms
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.filtering import filtered

Filter = tuple[Array, Array]  # numerator and denominator, ascending in q^-1


class _Answers(Protocol):
    """Holds the response of a plant, or of its loop, to a record from rest."""

    def signals(self, of: PowerKind, record: Array) -> Array: ...

    def adjoint(self, of: PowerKind, weights: Array) -> Array: ...

    def gradient(self, record: Array) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class RecordFilters:
    """Filters records of one channel in q^-1 by difference equations; `model` is the experiment's model.

    They are the same answers as of `RecordTransforms`, in a tenth of the time.
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
        """Return the response of the input or the output to the samples (n, 1) alone, as (n, 1)."""
        numerator, denominator = self._responses[of]
        return filtered(numerator, denominator, record, axis=0)

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals` (n, 1); a filter run backwards in time is its own."""
        return self.signals(of, weights[::-1])[::-1]

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi (n, k, 1), the gradient of the prediction, in these coordinates, noise whitened to 1."""
        sources, samples = self._sources(record), len(record)
        raw = np.zeros((samples, self.experiment.size))
        for column, parameter in enumerate(self.model.parameters):
            if parameter.letter in sources and parameter.power < samples:
                raw[parameter.power :, column] = sources[parameter.letter][: samples - parameter.power]
        return self.experiment.whiten_rows(raw)[:, :, None] / np.sqrt(self.model.covariance[0, 0])

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
        """Return the gradient with respect to a coefficient of A, B or F, but for its delay, (n,).

        It is minus the derivative of the prediction error epsilon = (D / C) (A y - (B / F) u). Filters run
        one after the other: a double pole in one product of their denominators costs half the digits.
        """
        m, letters = self.model, {p.letter for p in self.model.parameters}
        B, C, D, F = m.B[0][0], m.C[0], m.D[0], m.F[0][0]
        by_b = filtered(D, np.convolve(C, F), self.signals("input", record)[:, 0])
        sources = {"b": by_b}
        if "a" in letters:
            sources["a"] = filtered(-D, C, self.signals("output", record)[:, 0])
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
        """Return M0 + sum_t psi(t) Lambda^-1 psi(t)^T of samples (n, r), in these coordinates, (k, k)."""
        return self.known + self._excited(record)

    def information_of_experiment(self, record: Array) -> Array:
        """Return the information (k, k) of a full-length experiment that goes on as the record does."""
        share = self.experiment.samples / self.samples
        return self.experiment.baseline_information + share * self._excited(record)

    def _excited(self, record: Array) -> Array:
        psi = self.gradient(record)
        flat = psi.transpose(1, 0, 2).reshape(self.experiment.size, -1)
        return np.asarray(flat @ flat.T)

    def gradient(self, record: Array) -> NDArray[np.float64]:
        """Return psi of the prediction, from rest, in these coordinates, noise whitened to I, (n, k, p)."""
        return self._answers.gradient(record)

    @cached_property
    def known(self) -> Array:
        """Return M0 (k, k), known without any excitation; the noise part is scaled to the samples."""
        share = self.samples / self.experiment.samples
        return self.experiment.prior_information + share * self.experiment.noise_information

    def signals(self, of: PowerKind, record: Array) -> Array:
        """Return the response of inputs or outputs to the samples (n, r) alone, from rest, (n, channels)."""
        return record if self._is_record(of) else self._answers.signals(of, record)

    def mean_squares(self, of: PowerKind, record: Array) -> Array:
        """Return the powers of these signals (channels,)."""
        return np.mean(self.signals(of, record) ** 2, axis=0)

    @property
    def each(self) -> list[FiniteRecord]:
        """Return one `FiniteRecord` for every plant."""
        return [self]

    def mean_squares_of_each(self, of: PowerKind, record: Array) -> NDArray[np.float64]:
        """Return the powers (plants, channels) at every plant, or once if the record itself has them."""
        plants = self.each[:1] if self._is_record(of) else self.each
        return np.array([plant.mean_squares(of, record) for plant in plants])

    def adjoint(self, of: PowerKind, weights: Array) -> Array:
        """Return the transpose of `signals`, applied to weights (n, channels), (n, r)."""
        return weights if self._is_record(of) else self._answers.adjoint(of, weights)

    def _is_record(self, of: PowerKind) -> bool:
        """Return whether a signal is the excitation itself."""
        return of == "excitation" or (of == "input" and self.experiment.loop is None)

    @cached_property
    def _answers(self) -> _Answers:
        filters = RecordFilters.of(self.experiment)
        return filters or RecordTransforms(self.experiment, self.samples, self.step)


@dataclass(frozen=True)
class FiniteRecords(FiniteRecord):
    """Evaluates a record at several plants at once; information matrices are stacked.

    Signals are computed at the first plant, which `experiment` has; the `others` follow it.
    """

    others: tuple[Experiment, ...] = ()

    def information(self, record: Array) -> NDArray[np.float64]:
        """Return the information of each plant as in `FiniteRecord` (1 + others, k, k)."""
        return np.array([plant.information(record) for plant in self.each])

    @cached_property
    def known(self) -> NDArray[np.float64]:
        """Return the information of each plant as in `FiniteRecord` (1 + others, k, k)."""
        return np.array([plant.known for plant in self.each])

    @cached_property
    def each(self) -> list[FiniteRecord]:
        """Return one `FiniteRecord` for every plant, the first for the plant of `experiment`."""
        plants = (self.experiment, *self.others)
        return [FiniteRecord(plant, self.samples, self.step) for plant in plants]
