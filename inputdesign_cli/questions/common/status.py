"""The status of a design by what is proved of it."""

from __future__ import annotations

# A gap up to this many tolerances is almost optimal.
ALMOST = 100.0
_ROUNDING = 1e-6


def proof_status(gap: float, tolerance: float) -> str:
    """Whether the relative gap that is proved is as small as asked."""
    if gap <= tolerance * (1.0 + _ROUNDING):
        return "optimal"
    return "almost_optimal" if gap <= ALMOST * tolerance else "gap_open"
