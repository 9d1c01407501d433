"""A chirp of wanted powers: a multisine with the phases of Schroeder."""

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, SignalKind


class SchroederChirp(SignalKind):
    """Lines n = 1, 2, .. of shares p_n of the power have phases -2 pi sum_{l<n} (n - l) p_l."""

    several = False

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        powers, time = draft.lines.totals, np.arange(draft.samples)
        below = np.cumsum(powers / powers.sum()) - powers / powers.sum()
        phases = -2.0 * np.pi * np.cumsum(below)
        waves = np.cos(np.outer(time, draft.lines.frequencies) + phases)
        return (waves @ np.sqrt(2.0 * powers))[:, None]


KIND = SchroederChirp()
