"""Common phases of the lines of a multisine that keep all inputs, and what they cause, low at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.signal.crest import POWERS, STEPS, optimise_phases
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import block_vectors
from inputdesign_cli.signal.sinusoids import Sinusoids

# A frequency this near to a harmonic, in harmonics, is that one.
_ON_GRID = 1e-9

# From the lines (L, r) to a signal, and the largest modulus that it may have.
LimitedResponse = tuple[ComplexArray, float]


def schroeder_phases(lines: Lines, samples: int) -> Array:
    """(L,): the phases of [schroeder-1970] for the total power, common to all inputs and periods."""
    return _common(lines, samples, lines.totals).schroeder_phases()


def low_peak_phases(
    lines: Lines,
    samples: int,
    start: Array,
    *,
    limited: Sequence[LimitedResponse] = (),
    powers: Sequence[int] = POWERS,
    steps: int = STEPS,
) -> Array:
    """(L,): the common phases of the lines for which the joint peak over signals and periods is low.

    Args:
        samples: of the whole record, in as many periods as there are inputs.
        start: (L,), where to begin.
        limited: what is kept low; each input relative to its root mean square when nothing is limited.
        powers, steps: see `optimise_phases`.
    """
    rms = np.sqrt(lines.mean_squares)
    unit = np.eye(lines.inputs)
    inputs = [
        (np.broadcast_to(unit[a], (lines.frequencies.size, rms.size)), rms[a]) for a in np.flatnonzero(rms)
    ]
    gains: list[ComplexArray] = []
    for block in range(lines.inputs):
        vectors = block_vectors(lines, block)
        caused = [np.einsum("na,na->n", row, vectors) / bound for row, bound in limited or inputs]
        gains += [gain for gain in caused if np.any(gain)]
    unscaled = _common(lines, samples, np.ones(lines.frequencies.size))
    return optimise_phases(unscaled, start, gains=gains, powers=powers, steps=steps)


def _common(lines: Lines, samples: int, powers: Array) -> Sinusoids:
    """One period of sinusoids of these powers at the frequencies of the lines."""
    period, w = samples // lines.inputs, lines.frequencies
    repeats = period if lines.period == period else _repeats(w)
    if repeats is None or repeats > period:
        return Sinusoids(w, powers, period)
    return Sinusoids(w, powers, repeats, np.rint(w * repeats / (2 * np.pi)).astype(np.int_))


def _repeats(frequencies: Array) -> int | None:
    """Return the samples after which sinusoids repeat that are evenly spaced harmonics, otherwise None."""
    steps = np.diff(np.unique(frequencies), prepend=0.0)
    repeats = 2.0 * np.pi / np.min(steps[steps > 0.0], initial=np.inf)
    if not 1.0 <= repeats < np.inf:
        return None
    whole = int(np.rint(repeats))
    harmonics = frequencies * whole / (2.0 * np.pi)
    return whole if np.all(np.abs(harmonics - np.rint(harmonics)) < _ON_GRID) else None
