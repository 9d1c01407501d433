"""Shares, probabilities and rounded numbers as people read them."""

from __future__ import annotations

import numpy as np

_LARGE = 1000.0  # per cent; three digits would need an exponent
_LEAST = 1e-300
_EXACT = 1e-12  # relative rounding: a value this near to a rounded one equals it


def per_cent(share: float, digits: int = 3) -> str:
    """Return `0.123` as `12.3 %`, never with an exponent of ten in front of it."""
    value = 100.0 * share
    return f"{value:.0f} %" if abs(value) >= 10.0**digits or abs(value) >= _LARGE else f"{value:.{digits}g} %"


def chance(probability: float) -> str:
    """Return a probability for a sentence, also one too small for a double."""
    return f"{probability:.1e}" if probability >= _LEAST else f"below {_LEAST:.0e}"


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
