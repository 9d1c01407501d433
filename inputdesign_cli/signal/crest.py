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
        powers: the p, even numbers; with 4 alone the modulus comes out as even as can be.
        steps: of the quasi-Newton method, for each p.

    Raises:
        OutOfTimeError: see `seconds_left`.
    """
    signals: list[ComplexArray | None] = list(gains) or [None]
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


def joint_peak(lines: Sinusoids, phases: Array, signals: Sequence[ComplexArray | None] = (None,)) -> float:
    """The largest modulus over all samples of all the signals."""
    return max(float(np.abs(lines.record(phases, gains)).max()) for gains in signals)


def crest_factor(record: Array) -> float:
    """Largest modulus over root mean square; one for a record that is zero."""
    peak = float(np.abs(record).max())
    return peak / float(np.sqrt(np.mean(record**2))) if peak > 0.0 else 1.0


def _log_norm(
    phases: Array, lines: Sinusoids, signals: Sequence[ComplexArray | None], p: int
) -> tuple[float, Array]:
    """log of the p-norm (a mean) of all the signals, and its gradient with respect to the phases."""
    seconds_left()
    records = [lines.record(phases, gains) for gains in signals]
    peak = max(np.abs(record).max() for record in records)
    if peak == 0.0:  # so few samples that all of them are zeros of the sinusoids: no phase is better
        return 0.0, np.zeros(phases.size)
    count = sum(record.size for record in records)
    # Leave out negligible values: powers that underflow are slow.
    least = _NEGLIGIBLE ** (1.0 / p)
    relative = [np.where(np.abs(record) < least * peak, 0.0, record / peak) for record in records]
    powers = [np.abs(record) ** (p - 2) * record for record in relative]
    total = sum(float(power @ record) for power, record in zip(powers, relative, strict=True))
    slope = np.zeros(phases.size)
    for power, gains in zip(powers, signals, strict=True):
        slope += lines.slopes(phases, power / (peak * total), gains)
    return float(np.log(peak) + np.log(total / count) / p), slope
