"""Common phases of the lines of a multisine that keep all inputs and their responses low at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.signal.lines import Lines, block_vectors
from inputdesign_cli.signal.sinusoids import Sinusoids

# A frequency this near to a harmonic, in harmonic numbers, counts as on it.
_ON_GRID = 1e-9

# The response of a signal to the lines (L, r), and its largest admissible modulus.
LimitedResponse = tuple[ComplexArray, float]
POWERS = (4, 8, 16, 32, 64, 128, 256, 512)
STEPS = 150
_NEGLIGIBLE = 1e-40


def optimise_phases(
    lines: Sinusoids,
    start: Array,
    *,
    gains: Sequence[ComplexArray] = (),
    powers: Sequence[int] = POWERS,
    steps: int = STEPS,
) -> Array:
    """Return phases from `start` (L,) on that keep the largest of all samples low, as (L,).

    [guillaume-1991]: minimising the p-norm for p = 4, 8, 16, .. leads past the poor local optima of the peak.

    Args:
        gains: (L,) each, the signals to keep low as filters of the sinusoids, divided by their bounds; the
            record itself when there are none.
        powers: the p, powers of two; with 4 alone the modulus comes out as even as can be.
        steps: the steps of the quasi-Newton method, for each p.
    """
    signals = np.array(gains) if len(gains) else None
    phases, best = start, np.inf
    kept = start
    for p in powers:
        found = scipy.optimize.minimize(
            _log_norm,
            phases,
            args=(lines, signals, p),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": steps, "maxcor": 20},
        )
        phases = found.x
        peak = joint_peak(lines, phases, signals)
        if peak < best:
            kept, best = phases, peak
    return kept


def joint_peak(lines: Sinusoids, phases: Array, gains: ComplexArray | None = None) -> float:
    """Return the largest modulus over all samples of all the signals with these `gains` (S, L)."""
    return float(np.abs(lines.record(phases, gains)).max())


def crest_factor(record: Array) -> float:
    """Return the crest factor, largest modulus over root mean square; one for a record that is zero."""
    peak = float(np.abs(record).max())
    return peak / float(np.sqrt(np.mean(record**2))) if peak > 0.0 else 1.0


def _log_norm(phases: Array, lines: Sinusoids, gains: ComplexArray | None, p: int) -> tuple[float, Array]:
    """Return the log of the p-norm (a mean) of all the signals, and its gradient in the phases."""
    seconds_left()
    records = lines.record(phases, gains)
    peak = np.abs(records).max()
    if peak == 0.0:  # so few samples that all of them are zeros of the sinusoids: no phase is better
        return 0.0, np.zeros(phases.size)
    # Leave out negligible values: powers that underflow are slow.
    least = _NEGLIGIBLE ** (1.0 / p)
    relative = np.where(np.abs(records) < least * peak, 0.0, records / peak)
    powers = _power_before_last(relative, p)
    total = np.sum(powers * relative)
    slopes = np.atleast_2d(lines.slopes(phases, powers / (peak * total), gains))
    return float(np.log(peak) + np.log(total / records.size) / p), np.sum(slopes, axis=0)


def _power_before_last(values: Array, p: int) -> Array:
    """Return values^(p - 1) for a power of two p, by squaring: a tenth of the time of a general power."""
    power = square = values
    for _ in range(p.bit_length() - 2):
        square = square * square
        power = power * square
    return power


def schroeder_phases(lines: Lines, samples: int) -> Array:
    """Return the phases of [schroeder-1970] for the total power, common to all inputs and periods, (L,)."""
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
    """Return the common phases of the lines for which the joint peak over signals and periods is low, (L,).

    Args:
        samples: the samples of the whole record, in as many periods as there are inputs.
        limited: the signals to keep low; each input relative to its root mean square when nothing is limited.
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
    """Return one period of sinusoids of these powers at the frequencies of the lines."""
    period, w = samples // lines.inputs, lines.frequencies
    repeats = period if lines.period == period else _repeats(w)
    if repeats is None or repeats > period:
        return Sinusoids(w, powers, period)
    return Sinusoids(w, powers, repeats, np.rint(w * repeats / (2 * np.pi)).astype(np.int_))


def _repeats(frequencies: Array) -> int | None:
    """Return the samples after which evenly spaced harmonics repeat, otherwise None."""
    steps = np.diff(np.unique(frequencies), prepend=0.0)
    repeats = 2.0 * np.pi / np.min(steps[steps > 0.0], initial=np.inf)
    if not 1.0 <= repeats < np.inf:
        return None
    whole = int(np.rint(repeats))
    harmonics = frequencies * whole / (2.0 * np.pi)
    return whole if np.all(np.abs(harmonics - np.rint(harmonics)) < _ON_GRID) else None
