"""Shares and probabilities as people read them."""

from __future__ import annotations

_LARGE = 1000.0  # per cent, which three digits would write with an exponent
_LEAST = 1e-300


def per_cent(share: float, digits: int = 3) -> str:
    """`0.123` as `12.3 %`, never with an exponent of ten in front of it."""
    value = 100.0 * share
    return f"{value:.0f} %" if abs(value) >= 10.0**digits or abs(value) >= _LARGE else f"{value:.{digits}g} %"


def chance(probability: float) -> str:
    """A probability for a sentence, also one that is below the smallest number."""
    return f"{probability:.1e}" if probability >= _LEAST else f"below {_LEAST:.0e}"
