"""Pseudo-random binary sequences: a flat spectrum, whatever was designed."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, SignalKind

_LONGEST_REGISTER = 32


class Prbs(SignalKind):
    """A maximum length sequence, shifted by equal parts of it from input to input."""

    few_levels = True
    flat = True

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        samples, lines = draft.samples, draft.lines
        bits = draft.settings.bits or register_length(samples)
        return shifted_sequences(bits, samples, lines.inputs, rng) * np.sqrt(lines.mean_squares)


def pseudo_random(bits: int, samples: int, rng: np.random.Generator) -> Array:
    """Return a sequence of 2^bits - 1 values +1 and -1 from a random start, repeated, (samples,)."""
    if not 2 <= bits <= _LONGEST_REGISTER:
        raise ValueError(f"no register of {bits} bits")
    state = rng.integers(0, 2, bits)
    if not state.any():
        state[0] = 1
    import scipy.signal  # only now: see `plant.filtering`

    length = min(samples, 2**bits - 1)
    sequence, _ = scipy.signal.max_len_seq(bits, state=state, length=length)
    return np.resize(2.0 * sequence - 1.0, samples)


def register_length(samples: int) -> int:
    """Return the shortest register whose sequence does not repeat within `samples`."""
    return min(max(2, int(np.ceil(np.log2(samples + 1)))), _LONGEST_REGISTER)


def shifted_sequences(bits: int, samples: int, inputs: int, rng: np.random.Generator) -> Array:
    """Return one sequence, for each input shifted by an equal part of its length, (samples, inputs).

    Over a whole sequence of length L the inputs have the correlation -1 / L, except at lags of the shifts.
    """
    shift = min((2**bits - 1) // inputs, samples)
    sequence = pseudo_random(bits, (inputs - 1) * shift + samples, rng)
    return np.stack([sequence[a * shift : a * shift + samples] for a in range(inputs)], axis=1)
