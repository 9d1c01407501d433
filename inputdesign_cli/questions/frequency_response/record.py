"""The record of given lines whose peaks, or peaks beside their limits, are low."""

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
        """(length, r): of several choices of phases that of the lowest peak, for powers (L, r)."""
        r, period, settings = powers.shape[1], self.grid.period, self.settings
        diagonal = np.einsum("lr,rs->lrs", powers, np.eye(r)).astype(complex)
        lines = Lines(self.grid.frequencies, diagonal, period)
        limited = limited_responses(self.experiment, self.bounds, 1.0, 1, self.grid.frequencies)
        best: tuple[float, Array] | None = None
        for number in range(settings.candidates):
            rng = np.random.default_rng(np.random.SeedSequence(settings.seed, spawn_key=(_STREAM, number)))
            angles = 2.0 * np.pi * rng.random(len(powers))
            if settings.phases in ("schroeder", "optimised") and number == 0:
                angles = schroeder_phases(lines, period * r)
            if settings.phases == "optimised":
                angles = low_peak_phases(lines, period * r, angles, limited=limited)
            u = multisine_record(lines, length, rng, "orthogonal", angles=angles)
            height = self.beyond(u) if self.bounds.hard else float(np.max(np.abs(u)))
            if best is None or height < best[0]:
                best = height, u
            if settings.phases == "schroeder":
                break
        assert best is not None
        return best[1]

    def beyond(self, u: Array) -> float:
        """The largest share of their limits that samples of u (n, r), its moves and outputs take."""
        bounds, found = self.bounds, [0.0]
        if bounds.amplitude is not None:
            found.append(float(np.max(np.abs(u) / bounds.amplitude)))
        if bounds.rate is not None:
            found.append(float(np.max(np.abs(np.diff(u, axis=0, prepend=0.0)) / bounds.rate)))
        if bounds.output is not None:
            model = self.experiment.model
            quiet = np.zeros((1, 1, model.outputs))
            y = model.simulate(u[None], quiet, 1.0)[0][0]
            found.append(float(np.max(np.abs(y) / bounds.output)))
        return max(found)
