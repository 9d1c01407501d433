"""From continuous to discrete time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.signal

from inputdesign_cli.plant.polynomial import Rational


def zero_order_hold(numerator: Sequence[float], denominator: Sequence[float], period: float) -> Rational:
    """The zero-order-hold sample of a transfer function in s (descending powers), in q^-1 (ascending).

    `period` is in the unit of time of s. Any leading delay stays in the numerator.
    """
    sampled, poles, _ = scipy.signal.cont2discrete((numerator, denominator), period, method="zoh")
    # In z both have the same length, so that their coefficients are those of q^-1, ascending.
    return Rational.build(list(np.atleast_2d(sampled)[0]), [list(poles)])
