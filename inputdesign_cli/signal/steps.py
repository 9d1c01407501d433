"""Levels that are held for long, in random order."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, SignalKind

_LEVELS = 5


class Steps(SignalKind):
    """Equally spaced levels from -1 to 1, each held equally long, in a random order for each input."""

    flat = True

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        number, samples = draft.settings.number or _LEVELS, draft.samples
        levels = np.linspace(-1.0, 1.0, number)
        which = np.minimum(np.arange(samples) * number // samples, number - 1)
        return np.stack([rng.permutation(levels)[which] for _ in range(draft.lines.inputs)], axis=1)
