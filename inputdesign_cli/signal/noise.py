"""Gaussian noise, with the designed spectrum or flat."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, SignalKind
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import gaussian_record


class FilteredNoise(SignalKind):
    """Periodic Gaussian noise of the spectrum; a single period of one input may come from a filter."""

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        return gaussian_record(draft.lines, rng)


class WhiteNoise(SignalKind):
    """Gaussian noise, flat over the band, each input with its designed power and not correlated."""

    flat = True

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        period = draft.samples
        harmonics = np.arange(period // 2 + 1)
        w = 2.0 * np.pi * harmonics / period
        inside = (w >= draft.band[0] * (1 - 1e-9)) & (w <= draft.band[1] * (1 + 1e-9))
        ends = (harmonics == 0) | (2 * harmonics == period)
        share = np.where(inside, np.where(ends, 0.5, 1.0), 0.0)
        share = share / max(float(share.sum()), 1e-300)
        powers = share[:, None, None] * np.diag(draft.lines.mean_squares).astype(complex)
        return gaussian_record(Lines.of_period(powers, period), rng)
