"""Means or lines were taken away from signals."""

from __future__ import annotations

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, FindingKind, Severity

TREND_REMOVED = FindingKind(
    "trend-removed",
    Severity.NOTE,
    "a mean or a line was taken away",
    "With `--detrend` the mean or a straight line is taken away from every signal, segment by segment.",
    "Nothing. The level and slope of every output are estimated together with the model.",
)


def trend_removed(name: str, away: Array, *, line: bool) -> Finding:
    """Say what was taken away from a signal: `away` (n,)."""
    first, last = float(away[0]), float(away[-1])
    what = f"a line from {first:.6g} to {last:.6g}" if line else f"the mean {first:.6g}"
    said = f"Taken away from {name}: {what}."
    return TREND_REMOVED.found(said, where=name, first=first, last=last, line=line)
