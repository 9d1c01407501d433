"""Phases of a low crest factor: the p-norm of the record minimised for p rising.

[guillaume-1991]: minimising the p-norm for p = 4, 8, 16, .. leads past the poor local optima of the peak
itself. Several signals that are linear in the same sinusoids (the output, the moves) may be kept low at
once: the joint peak is that of all of them, each over its own bound.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.signal.sinusoids import Sinusoids

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
    """(L,): phases from `start` (L,) on that keep the largest of all samples low.

    Args:
        gains: (L,) each, the signals to keep low as filters of the sinusoids, divided by what each may
            reach; the record itself when there are none.
        powers: the p, powers of two; with 4 alone the modulus comes out as even as can be.
        steps: of the quasi-Newton method, for each p.

    Raises:
        OutOfTimeError: see `seconds_left`.
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
    """Largest modulus over root mean square; one for a record that is zero."""
    peak = float(np.abs(record).max())
    return peak / float(np.sqrt(np.mean(record**2))) if peak > 0.0 else 1.0


def _log_norm(phases: Array, lines: Sinusoids, gains: ComplexArray | None, p: int) -> tuple[float, Array]:
    """log of the p-norm (a mean) of all the signals, and its gradient with respect to the phases."""
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
