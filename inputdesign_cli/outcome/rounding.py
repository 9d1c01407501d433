"""Numbers that are printed to be used: rounded to the side on which they still hold."""

from __future__ import annotations

import numpy as np

_EXACT = 1e-12  # a value this near to its digits has them


def rounded_up(value: float, digits: int = 6) -> str:
    """Round up to this number of digits, so that the printed value suffices."""
    return _rounded(value, digits, 1.0)


def rounded_down(value: float, digits: int) -> str:
    """Round down to this number of digits."""
    return _rounded(value, digits, -1.0)


def _rounded(value: float, digits: int, side: float) -> str:
    if value == 0.0:
        return "0"
    unit = 10.0 ** (digits - 1 - int(np.floor(np.log10(abs(value)))))
    whole = side * np.ceil(side * value * unit - abs(value) * unit * _EXACT)
    return f"{whole / unit:.{digits}g}"
