"""A sinusoid whose frequency rises."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, SignalKind


class Chirp(SignalKind):
    """A sinusoid of one input whose frequency rises evenly over the band."""

    several = False
    flat = True

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        import scipy.signal  # only now: see `plant.filtering`

        t = np.arange(draft.samples, dtype=float)
        lo, hi = (edge / (2.0 * np.pi) for edge in draft.band)
        return np.asarray(scipy.signal.chirp(t, lo, float(draft.samples), hi, phi=-90.0))[:, None]
