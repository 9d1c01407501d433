"""The excitations of a Monte Carlo study: one row a run, each with a realisation of its own."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import DesignedSpectrum, SignalGenerator, SignalSettings
from inputdesign_cli.signal.single import record_information
from inputdesign_cli.spectrum import FirBasis, LinesBasis


@dataclass(frozen=True)
class Excitation:
    """A spectrum that every run realises anew by `recipe`, or one `record` (samples,) that all runs apply."""

    name: str
    basis: FirBasis | LinesBasis = field(default_factory=lambda: FirBasis(0))
    x: Array = field(default_factory=lambda: np.ones(1))
    recipe: SignalSettings = field(default_factory=SignalSettings)
    record: Array | None = None

    def draw(self, runs: int, samples: int, rng: np.random.Generator) -> Array:
        """(runs, samples): records, each scaled to the power of the spectrum exactly."""
        if self.record is not None:
            return np.broadcast_to(self.record, (runs, self.record.size))
        generator = SignalGenerator(DesignedSpectrum.of(self.basis, self.x), self.recipe, samples)
        rows = np.stack([np.repeat(generator.values(rng)[:, 0], self.recipe.hold) for _ in range(runs)])
        return rows * np.sqrt(generator.spectrum.power / np.mean(rows**2, axis=1, keepdims=True))

    def information(self, experiment: Experiment) -> Array:
        """(k, k) in raw parameters: what this excitation tells in theory, prior information included."""
        if self.record is not None:
            return record_information(experiment, self.record)
        maps = self.basis.integrals(experiment.information_density, experiment.singularities)
        return experiment.baseline_information + np.tensordot(self.x, maps, axes=1)
