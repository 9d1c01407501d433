"""Controllers in s as a computer runs them: q^-1 in place of s ([astrom-wittenmark-1997], Chapter 8)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.plant.held import HeldEntry
from inputdesign_cli.plant.transfer import Rational, product_of


def zero_order_hold(
    numerator: Sequence[float], denominator: Sequence[float], period: float, delay: float = 0.0
) -> Rational:
    """Return the zero-order-hold sample of a transfer function in s (descending powers), in q^-1 (ascending).

    The period and the dead time are in the unit of time of s. A leading delay stays in the numerator.
    """
    if delay:
        low, high = (np.trim_zeros(np.array(p[::-1], dtype=float), "b") for p in (numerator, denominator))
        if not low.size:
            return Rational(np.zeros(1))
        entry = HeldEntry.of(low / high[-1], high / high[-1], period, delay)
        return Rational(entry.sampled[0], (entry.sampled[1],))
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
    """Sample every entry of a matrix behind a hold, with its dead time: return B and F, ascending in q^-1."""
    held = [
        [zero_order_hold(above, below, period, late) for above, below, late in zip(*rows, strict=True)]
        for rows in zip(numerators, denominators, delays, strict=True)
    ]
    above = tuple(tuple(entry.numerator for entry in row) for row in held)
    return above, tuple(tuple(entry.denominator_polynomial for entry in row) for row in held)


Rule = Literal["tustin", "backward", "zoh"]
_DIFFERENCE = np.array([1.0, -1.0])
_SUM = np.array([1.0, 1.0])


def discretised(
    numerator: Sequence[float], factors: Sequence[Sequence[float]], period: float, rule: Rule
) -> Rational:
    """Return the discretisation in q^-1 of a proper transfer function in s (descending), at this period."""
    if rule == "zoh":
        return zero_order_hold(numerator, product_of(factors).tolist(), period)
    orders = [len(factor) - 1 for factor in factors]
    below = [_substituted(factor, order, period, rule) for factor, order in zip(factors, orders, strict=True)]
    lead = float(np.prod([p[0] for p in below]))
    top = _substituted(np.trim_zeros(np.asarray(numerator, dtype=float), "f"), sum(orders), period, rule)
    return Rational(top / lead, tuple(p / p[0] for p in below))


def _substituted(descending: Sequence[float] | Array, order: int, period: float, rule: Rule) -> Array:
    """Return a polynomial at s = (1 - q^-1) / (h or h/2 (1 + q^-1)), times the denominator^`order`."""
    total = np.zeros(order + 1)
    for power, coefficient in enumerate(descending[::-1]):
        ups = [_DIFFERENCE] * power
        downs = [_SUM] * (order - power) if rule == "tustin" else []
        rate = (2.0 if rule == "tustin" else 1.0) / period
        term = coefficient * rate**power * product_of([*ups, *downs])
        total[: term.size] += term
    return total


def pid(
    gain: float, integral: float | None, derivative: float, filtering: float, period: float, rule: Rule
) -> Rational:
    """Return Kp (1 + 1 / (Ti s) + Td s / (Tf s + 1)) in q^-1; its integrator is a factor of its own.

    The integral time Ti is None for no integral action; `derivative` is Td, `filtering` Tf.
    """
    parts = [Rational(np.array([gain]), ())]
    if integral is not None:
        parts.append(discretised([gain / integral], [[1.0, 0.0]], period, rule))
        parts[-1] = Rational(parts[-1].numerator, (_DIFFERENCE,))
    if derivative:
        slope = [gain * derivative, 0.0]
        if filtering:
            parts.append(discretised(slope, [[filtering, 1.0]], period, rule))
        else:
            parts.append(Rational(gain * derivative / period * _DIFFERENCE, ()))
    return _added(parts)


def _added(parts: Sequence[Rational]) -> Rational:
    """Return the sum of parts that have no pole in common."""
    below = tuple(factor for part in parts for factor in part.denominator)
    total = np.zeros(1)
    for part in parts:
        others = [factor for other in parts if other is not part for factor in other.denominator]
        total = np.asarray(ascending.polyadd(total, product_of([part.numerator, *others])), dtype=float)
    return Rational(total, below)


def delayed(transfer: Rational, samples: int) -> Rational:
    """Return the transfer function with a further delay of this number of samples."""
    return Rational(np.concatenate([np.zeros(samples), transfer.numerator]), transfer.denominator)
