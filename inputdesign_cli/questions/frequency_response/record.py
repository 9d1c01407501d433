"""Make a record of given lines with low peaks, relative to the limits on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment
from inputdesign_cli.signal import (
    Bounds,
    Lines,
    SignalSettings,
    limited_responses,
    low_peak_phases,
    multisine_record,
    schroeder_phases,
)
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid

_STREAM = 0x5EED


@dataclass(frozen=True)
class LineRecords:
    """Periodic records with lines on a grid of harmonics, and the limits on their samples."""

    experiment: Experiment
    grid: HarmonicGrid
    settings: SignalSettings
    bounds: Bounds

    def best(self, powers: NDArray[np.float64], length: int) -> Array:
        """Return the record (length, r) of the lowest peak among several choices of phases.

        Args:
            powers: (L, r) of the lines.
        """
        r, period, settings = powers.shape[1], self.grid.period, self.settings
        diagonal = np.einsum("lr,rs->lrs", powers, np.eye(r)).astype(complex)
        lines = Lines(self.grid.frequencies, diagonal, period)
        limited = limited_responses(self.experiment, self.bounds, 1.0, 1, self.grid.frequencies)

        def drawn(number: int) -> Array:
            rng = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(_STREAM, number)))
            angles = 2.0 * np.pi * rng.random(len(powers))
            if settings.phases in ("schroeder", "optimised") and number == 0:
                angles = schroeder_phases(lines, period * r)
            if settings.phases == "optimised":
                angles = low_peak_phases(lines, period * r, angles, limited=limited)
            return multisine_record(lines, length, rng, "orthogonal", angles=angles)

        def height(u: Array) -> float:
            return self.beyond(u) if self.bounds.hard else float(np.max(np.abs(u)))

        return min(
            map(drawn, range(1 if settings.phases == "schroeder" else settings.candidates)), key=height
        )

    def beyond(self, u: Array) -> float:
        """Return the largest share of their limits that samples of u (n, r), its moves and outputs take."""
        bounds, moves = self.bounds, np.diff(u, axis=0, prepend=0.0)
        limited = [(u, bounds.amplitude), (moves, bounds.rate)]
        if bounds.output is not None:
            limited.append((self.answer(u), bounds.output))
        shares = [float(np.max(np.abs(x) / most)) for x, most in limited if most is not None]
        return max(shares, default=0.0)

    def answer(self, u: Array) -> Array:
        """Return the outputs (n, p) to inputs u (n, r) from rest, without noise."""
        model = self.experiment.model
        return np.asarray(model.simulate(u[None], np.zeros((1, 1, model.outputs)), 1.0)[0][0])
