"""Not all of a record counts for a frequency response: lines, samples and periods that are left out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.outcome.units import Units

REMEDY = (
    "apply the signal.csv of the spec and record u as it was applied, or see whether the record is another's"
)
UNLIKE = 0.5
"""Inputs of which more than this share differs from period to period do not repeat, even in a loop."""

UNEXCITED = FindingKind(
    "unexcited-lines",
    Severity.DOUBT,
    "lines of the spec that the inputs do not excite",
    "At some lines of the spec the inputs have no more power than rounding or noise. The response is not "
    "measured there.",
    "Apply the signal of the spec, and record the inputs as they were applied.",
)
DIFFERING = FindingKind(
    "inputs-do-not-repeat",
    Severity.DOUBT,
    "the inputs differ from period to period",
    "More than half of the power of the inputs differs from period to period, so that they do not repeat as "
    "the spec says.",
    "Apply the signal of the spec, and record the inputs as they were applied.",
)
LEFT_OUT = FindingKind(
    "samples-before-periods",
    Severity.NOTE,
    "samples before the first whole period are left out",
    "The record is no multiple of the period. Its last whole periods count.",
    "Record whole periods.",
)
PIECES = FindingKind(
    "periods-between-gaps",
    Severity.NOTE,
    "only periods without a gap count",
    "The record has gaps. The whole periods of one phase between the gaps count, after the transient.",
    "Record without gaps where more periods are needed.",
)


def unexcited_lines(units: Units, frequencies: Array, excited: NDArray[np.bool_]) -> list[Finding]:
    """Return a finding on lines (L,), in rad/sample, that the data do not excite."""
    lacking = frequencies[~excited] / units.frequency
    if not lacking.size:
        return []
    return [
        UNEXCITED.found(
            f"{lacking.size} of {excited.size} lines of the spec, the first at {lacking[0]:.4g} "
            f"{units.per_time}, have no more of the inputs than rounding or noise. The response is not "
            f"measured there: {REMEDY}",
            lines=int(lacking.size),
            asked=int(excited.size),
            first=float(lacking[0]),
        )
    ]


def inputs_do_not_repeat(differing: float, period: int) -> list[Finding]:
    """Return a finding where too large a share of the power of the inputs differs over periods."""
    if differing <= UNLIKE:
        return []
    return [
        DIFFERING.found(
            f"{100.0 * differing:.3g} % of the power of the inputs differs from period to period of {period} "
            f"samples, so that they do not repeat as the spec says: {REMEDY}",
            share=differing,
            period=period,
        )
    ]


def samples_before_periods(samples: int, periods: Periods) -> list[Finding]:
    """Return a finding on samples of a record before its first whole period."""
    left = samples - periods.each(samples) * periods.blocks * periods.period
    if not left:
        return []
    rest = f"the others are whole periods of {periods.period}"
    message = f"the first {left} of {samples} samples are left out: {rest}"
    return [LEFT_OUT.found(message, samples=left, period=periods.period)]


def periods_between_gaps(pieces: int, taken: int, period: int) -> Finding:
    """Return the finding that a record has several pieces without gaps, and periods in them."""
    return PIECES.found(
        f"the data have {pieces} pieces without gaps. The {taken} whole periods of {period} samples in them "
        "count, after the transient",
        pieces=pieces,
        periods=taken,
        period=period,
    )
