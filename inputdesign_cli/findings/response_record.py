"""A record that is designed for a frequency response does less than the design, or is shorter than asked."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, FindingKind, Severity

# A shift of the response by the start that is worth a finding, in standard deviations.
_SHIFTED = 0.2
_ROUNDING = 1e-9

START = FindingKind(
    "start-shifts-response",
    Severity.DOUBT,
    "the start of the record shifts the response",
    "The plant begins at rest, and the transient has not died out where the periods begin to count.",
    "Raise `accuracy.frequency_response.transient`, or take a longer period.",
)
LEAKS = FindingKind(
    "noise-leaks",
    Severity.DOUBT,
    "noise that leaks through the finite record exceeds the accuracy",
    "A finite record sees noise of neighbouring frequencies at every line. The limits keep the powers from "
    "making up for it.",
    "Allow a little more power, or take a few more periods.",
)
SHORTER = FindingKind(
    "record-of-whole-periods",
    Severity.NOTE,
    "the record is shorter than the experiment",
    "A record for a frequency response consists of whole periods.",
    "Choose a number of samples that is a multiple of the periods.",
)


def start_shifts(shift: float) -> list[Finding]:
    """Return a finding where the start shifts the response, by this in standard deviations."""
    if shift <= _SHIFTED:
        return []
    message = (
        f"the start of the record shifts the response by up to {shift:.2g} standard deviations: raise "
        "accuracy.frequency_response.transient, or take a longer period"
    )
    return [START.found(message, where="accuracy.frequency_response.transient", shift=shift)]


def noise_leaks(ratio: float) -> list[Finding]:
    """Return a finding where the deviation of a record is more than the admitted one by this ratio."""
    if ratio <= 1.0 + _ROUNDING:
        return []
    message = (
        f"noise leaks through the finite length of the record, so that it reaches {ratio:.7g} times the "
        "deviation admitted. The limits leave no room to mend that: allow a little more power or a few more "
        "periods"
    )
    return [LEAKS.found(message, where="limits", ratio=ratio)]


def record_of_whole_periods(samples: int, asked: int, periods: int, period: int) -> list[Finding]:
    """Return a finding where whole periods make the record shorter than what is asked."""
    if samples >= asked:
        return []
    message = f"the record has {samples} of the {asked} samples: {periods} whole periods of {period}"
    return [SHORTER.found(message, where="experiment.samples", samples=samples, asked=asked)]
