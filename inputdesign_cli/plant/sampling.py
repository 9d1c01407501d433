"""Sample transfer functions: from continuous to discrete time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Rows
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.plant.transfer import Rational


def zero_order_hold(numerator: Sequence[float], denominator: Sequence[float], period: float) -> Rational:
    """The zero-order-hold sample of a transfer function in s (descending powers), in q^-1 (ascending).

    `period` is in the unit of time of s. Any leading delay stays in the numerator.
    """
    if len(denominator) == 1:
        return Rational(np.array([numerator[-1] / denominator[0]]))
    import scipy.signal  # only now: see `plant.filtering`

    # scipy takes coefficients below 1e-14 for zeros, so it gets a numerator of order one.
    given = np.trim_zeros(np.asarray(numerator, dtype=float), "f")
    gain = float(np.abs(given).max(initial=0.0))
    scaled = given / gain if gain > 0 else np.ones(1)
    above, below, _ = scipy.signal.cont2discrete((scaled, denominator), period, method="zoh")
    # In z both have the same length, so that they are the coefficients in q^-1, ascending.
    top = gain * np.ravel(above).astype(float)
    return Rational(np.concatenate([np.zeros(below.size - top.size), top]), (below,))


def hold_entries(
    numerators: Sequence[Sequence[Sequence[float]]],
    denominators: Sequence[Sequence[Sequence[float]]],
    period: float,
    delays: Sequence[Sequence[float]],
) -> tuple[Rows, Rows]:
    """Sample every entry of a matrix behind a hold: return polynomials in q^-1, ascending.

    Args:
        delays: the dead times of the entries.
    """
    held = [
        [_held(above, below, period, late) for above, below, late in zip(*rows, strict=True)]
        for rows in zip(numerators, denominators, delays, strict=True)
    ]
    above = tuple(tuple(entry.numerator for entry in row) for row in held)
    return above, tuple(tuple(entry.denominator_polynomial for entry in row) for row in held)


def _held(above: Sequence[float], below: Sequence[float], period: float, delay: float) -> Rational:
    """One entry, with its dead time."""
    if not delay:
        return zero_order_hold(above, below, period)
    low, high = (np.trim_zeros(np.array(p[::-1], dtype=float), "b") for p in (above, below))
    if not low.size:
        return Rational(np.zeros(1))
    numerator, denominator = HeldEntry.of(low / high[-1], high / high[-1], period, delay).sampled
    return Rational(numerator, (denominator,))
