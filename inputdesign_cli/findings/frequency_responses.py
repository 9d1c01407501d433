"""A frequency response from data or for a design: what counts, and what was not measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.units import Units

# At how many of the frequencies no model is right any more.
_MOST_FAR = 0.1
# A shift of the response by the start that is worth a finding, in standard deviations.
_SHIFTED, _ROUNDING = 0.2, 1e-9
BY_U = (
    "the frequency response without a model is from u to y in a loop: where the noise is strong it is drawn "
    "towards -1/C; record the reference as column r, and it is estimated from r"
)
REMEDY = (
    "apply the signal.csv of the spec and record u as it was applied, or see whether the record is another's"
)
UNLIKE = 0.5
"""Inputs of which more than this share differs from period to period do not repeat, even in a loop."""

WITHOUT_MODEL = note(
    "response-without-model",
    "The frequency response was measured without a model. `frequency_response.csv` holds G from the data, "
    "with 95 % discs. A correct model lies outside of them at about 5 % of the frequencies.",
    "Compare it with the model in `frequency_response.png`.",
)
BIASED = doubt(
    "response-biased-by-loop",
    "The response without a model is biased towards -1/C. The reference of the loop is not recorded. Where "
    "noise is strong, the ratio of y to u shows the inverse controller.",
    "Record the reference as column r.",
)
CONTRADICTED = doubt(
    "response-contradicts-model",
    "The data contradict G of the model. At many frequencies G without a model lies outside the 95 % discs, "
    "by more than a fifth of |G|.",
    "Check whether the data come from a loop, the plant is linear, and all inputs are recorded.",
)
UNEXCITED = doubt(
    "unexcited-lines",
    "The inputs do not excite some lines of the spec. Their power there is only rounding or noise, and the "
    "response is not measured.",
    "Apply the signal of the spec, and record the applied inputs.",
)
DIFFERING = doubt(
    "inputs-do-not-repeat",
    "The inputs differ from period to period. More than half of their power does not repeat, contrary to "
    "the spec.",
    "Apply the signal of the spec, and record the applied inputs.",
)
LEFT_OUT = note(
    "samples-before-periods",
    "Samples before the first whole period are left out. The length of the record is no multiple of the "
    "period.",
    "Record whole periods.",
)
PIECES = note(
    "periods-between-gaps",
    "Only periods without a gap count. They are the whole periods of one phase between the gaps, after the "
    "transient.",
    "Record without gaps, if more are needed.",
)
START = doubt(
    "start-shifts-response",
    "The start of the record biases the response. The plant begins at rest, and its transient is still "
    "present in the periods that count.",
    "Raise `accuracy.frequency_response.transient`, or take a longer period.",
)
LEAKS = doubt(
    "noise-leaks",
    "Leakage of noise exceeds the required accuracy. In a finite record, noise of neighbouring frequencies "
    "leaks into every line. The limits forbid the power that would compensate for it.",
    "Allow a little more power, or take a few more periods.",
)
SHORTER = note(
    "record-of-whole-periods",
    "The record is shorter than the experiment. A record for a frequency response consists of whole periods.",
    "Choose a number of samples that is a multiple of the period.",
)


def response_note(of: MeasuredLines) -> list[Finding]:
    """Return what a user should know of a frequency response without a model."""
    usual = "" if of.caveat else " (a right model: at about 5 %)"
    entries = "" if of.entries == 1 else f", counted over {of.entries} entries of G"
    outside = of.model_outside or 0.0
    message = (
        "frequency_response.csv has what the data say of G without a "
        f"model{', by the reference' if of.excitation == 'r' else ''}, with discs of 95 %: the model is "
        f"outside at {100 * outside:.0f} % of {of.frequencies} frequencies{entries}{usual}"
    )
    found = WITHOUT_MODEL.found(message, where="frequency_response.csv", model_outside=outside)
    return [found, *([BIASED.found(of.caveat, where="r")] if of.caveat else [])]


def contradicted(of: MeasuredLines) -> list[Finding]:
    """Return a finding where data and model differ in G, if both are of one plant: in open loop."""
    far = of.model_far_outside or 0.0
    message = (
        "what the data say of G without a model contradicts it: the model is farther off than the discs of "
        f"95 %, and by a fifth of |G| besides, at {100 * far:.0f} % of the frequencies "
        "(frequency_response.png): the data may come from a loop that was not seen, the plant may not be "
        "linear, or something else moves it along with the inputs"
    )
    found = CONTRADICTED.found(message, where="frequency_response.csv", model_far_outside=far)
    return [] if of.caveat or far < _MOST_FAR else [found]


def unexcited_lines(units: Units, frequencies: Array, excited: NDArray[np.bool_]) -> list[Finding]:
    """Return a finding on lines (L,), in rad/sample, that the data do not excite."""
    lacking = frequencies[~excited] / units.frequency
    if not lacking.size:
        return []
    lines, asked, first = int(lacking.size), int(excited.size), float(lacking[0])
    message = (
        f"{lines} of {asked} lines of the spec, the first at {first:.4g} {units.per_time}, have no more of "
        f"the inputs than rounding or noise. The response is not measured there: {REMEDY}"
    )
    return [UNEXCITED.found(message, lines=lines, asked=asked, first=first)]


def inputs_do_not_repeat(differing: float, period: int) -> list[Finding]:
    """Return a finding where too large a share of the power of the inputs differs over periods."""
    message = (
        f"{100.0 * differing:.3g} % of the power of the inputs differs from period to period of {period} "
        f"samples, so that they do not repeat as the spec says: {REMEDY}"
    )
    return [DIFFERING.found(message, share=differing, period=period)] if differing > UNLIKE else []


def samples_before_periods(samples: int, periods: Periods) -> list[Finding]:
    """Return a finding on samples of a record before its first whole period."""
    left = samples - periods.each(samples) * periods.blocks * periods.period
    rest = f"the others are whole periods of {periods.period}"
    message = f"the first {left} of {samples} samples are left out: {rest}"
    return [LEFT_OUT.found(message, samples=left, period=periods.period)] if left else []


def periods_between_gaps(pieces: int, taken: int, period: int) -> Finding:
    """Return the finding that a record has several pieces without gaps, and periods in them."""
    message = (
        f"the data have {pieces} pieces without gaps. The {taken} whole periods of {period} samples in them "
        "count, after the transient"
    )
    return PIECES.found(message, pieces=pieces, periods=taken, period=period)


def start_shifts(shift: float) -> list[Finding]:
    """Return a finding where the start shifts the response, by this in standard deviations."""
    where = "accuracy.frequency_response.transient"
    message = (
        f"the start of the record shifts the response by up to {shift:.2g} standard deviations: raise "
        f"{where}, or take a longer period"
    )
    return [START.found(message, where=where, shift=shift)] if shift > _SHIFTED else []


def noise_leaks(ratio: float) -> list[Finding]:
    """Return a finding where the deviation of a record is more than the admitted one by this ratio."""
    message = (
        f"noise leaks through the finite length of the record, so that it reaches {ratio:.7g} times the "
        "deviation admitted. The limits leave no room to mend that: allow a little more power or a few more "
        "periods"
    )
    return [LEAKS.found(message, where="limits", ratio=ratio)] if ratio > 1.0 + _ROUNDING else []


def record_of_whole_periods(samples: int, asked: int, periods: int, period: int) -> list[Finding]:
    """Return a finding where whole periods make the record shorter than what is asked."""
    message = f"the record has {samples} of the {asked} samples: {periods} whole periods of {period}"
    found = SHORTER.found(message, where="experiment.samples", samples=samples, asked=asked)
    return [found] if samples < asked else []
