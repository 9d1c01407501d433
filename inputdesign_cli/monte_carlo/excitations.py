"""The excitations of a Monte Carlo study: a record for each run, and its information in theory."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Protocol

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.lines import DesignedSpectrum, constant_density
from inputdesign_cli.signal.multisine import in_phase_record
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.spectrum import Basis, LinesBasis, TabulatedSpectrum


class Excitation(Protocol):
    """An excitation that the runs apply."""

    @property
    def name(self) -> str:
        """Return the name of the excitation in results."""

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """Return records (runs, samples, r), each a realisation of its own."""

    def information(self, experiment: Experiment) -> Array:
        """Return the information matrix in theory, (k, k) in raw parameters, prior information included."""


@dataclass(frozen=True)
class Recorded:
    """Holds one record (samples, r) that all runs apply, its samples `step` apart."""

    name: str
    record: Array
    step: float

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """Return the same record for each run."""
        return np.broadcast_to(self.record, (runs, *self.record.shape))

    def information(self, experiment: Experiment) -> Array:
        """Return the information matrix of the samples themselves."""
        return FiniteRecord(experiment, len(self.record), self.step).information(self.record)


@dataclass(frozen=True)
class Redrawn:
    """Draws records of a spectrum, new ones in each run, each channel scaled to its power exactly.

    `basis` and `x` are the spectrum that the generator realises.
    """

    name: str
    generator: SignalGenerator
    basis: Basis | TabulatedSpectrum
    x: Array

    @classmethod
    def flat(
        cls,
        name: str,
        method: str,
        powers: Array,
        band: tuple[float, float],
        samples: int,
        step: float,
        hold: int = 1,
    ) -> Redrawn:
        """Build independent inputs of these powers (r,), flat over a band in the unit of the experiment."""
        white = TabulatedSpectrum.white(powers, band)
        spectrum = DesignedSpectrum.of(white, np.ones(1), inputs=powers.size, step=step)
        settings = SignalSettings(method, "orthogonal" if powers.size > 1 else "random", hold=hold)
        edges = (band[0] * step, band[1] * step)
        return cls(name, SignalGenerator(spectrum, settings, samples, edges), white, np.ones(1))

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """Return records of the generator's kind of signal."""
        values = self.generator.several([rng] * runs)
        records = np.repeat(values, self.generator.settings.hold, axis=1)
        found = np.mean(records**2, axis=1, keepdims=True)
        return np.asarray(records * np.sqrt(self.powers / np.maximum(found, 1e-300)))

    @cached_property
    def powers(self) -> Array:
        """Return the power of each channel (r,)."""
        units = np.eye(self.generator.spectrum.inputs)
        densities = [partial(constant_density, np.diag(unit)) for unit in units]
        nowhere = np.zeros(0, dtype=complex)
        return np.array([float(self.x @ self.basis.integrals(one, nowhere)) for one in densities])

    def information(self, experiment: Experiment) -> Array:
        """Return the information matrix of the spectrum."""
        return spectral_information(self.basis, self.x, experiment)


@dataclass(frozen=True)
class Reapplied:
    """Applies each record of an excitation in `times` runs: some kinds of signals take long to make."""

    excitation: Excitation
    times: int

    @property
    def name(self) -> str:
        """Return the name of the excitation."""
        return self.excitation.name

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """Return the records of the excitation, one after the other, repeated."""
        records = self.excitation.draw(-(-runs // self.times), samples, rng)
        return np.repeat(records, self.times, axis=0)[:runs]

    def information(self, experiment: Experiment) -> Array:
        """Return the information matrix of the excitation."""
        return self.excitation.information(experiment)


@dataclass(frozen=True)
class InPhase:
    """Draws sinusoids of `amplitudes` (L, r) at `frequencies` (L,), rad per step, in phase over the channels.

    `basis` and `x` are their spectrum.
    """

    name: str
    frequencies: Array
    amplitudes: Array
    basis: LinesBasis
    x: Array

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """Return records of random phases."""
        return np.stack(
            [in_phase_record(self.frequencies, self.amplitudes, samples, rng) for _ in range(runs)]
        )

    def information(self, experiment: Experiment) -> Array:
        """Return the information matrix of the sinusoids."""
        return spectral_information(self.basis, self.x, experiment)


def spectral_information(basis: Basis | TabulatedSpectrum, x: Array, experiment: Experiment) -> Array:
    """Return M of a spectrum in the coordinates of an experiment, (k, k)."""
    maps = basis.integrals(experiment.information_density, experiment.singularities)
    return np.asarray(experiment.baseline_information + np.tensordot(x, maps, axes=1))
