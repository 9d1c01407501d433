"""Compute the information matrix of a finite record itself, not of the spectrum it was drawn from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.information.experiment import Experiment, PowerKind
from inputdesign_cli.information.record_filters import RecordFilters
from inputdesign_cli.information.record_transforms import RecordTransforms


class _Answers(Protocol):
    """Holds the response of a plant, or of its loop, to a record from rest."""

    def signals(self, of: PowerKind, record: Array) -> Array: ...

    def adjoint(self, of: PowerKind, weights: Array) -> Array: ...

    def gradient(self, record: Array) -> NDArray[np.float64]: ...


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
        """Return the information (k, k) of an experiment of full length, extrapolated from the record."""
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
