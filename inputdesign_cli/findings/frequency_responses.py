"""A frequency response from data or for a design: what counts, and what was not measured."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, doubt, finding
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.units import Units

# At how many of the frequencies no model is right any more.
_MOST_FAR = 0.1
# A shift of the response by the start that is worth a finding, in standard deviations.
_SHIFTED, _ROUNDING = 0.2, 1e-9
BY_U = (
    "the frequency response without a model is from u to y in a loop: where the noise is strong it is biased "
    "towards -1/C; record the reference as column r, and it is estimated from r"
)
REMEDY = "apply the signal.csv of the spec, and record u as it was applied"
UNLIKE = 0.5
"""Inputs of which more than this share differs from period to period do not repeat, even in a loop."""
_TRANSIENT = "accuracy.frequency_response.transient"

BIASED = doubt(
    "response-biased-by-loop",
    "The response without a model is biased towards -1/C. The reference of the loop is not recorded. Where "
    "noise is strong, the ratio of y to u shows the inverse controller.",
    "Record the reference as column r.",
)


@finding(NOTE, "response-without-model", "Compare it with the model in `frequency_response.png`.")
def response_note(kind: FindingKind, of: MeasuredLines) -> list[Finding]:
    """The frequency response was measured without a model. A right model is outside of 5 % of the discs."""
    entries = "" if of.entries == 1 else f", counted over {of.entries} entries of G"
    outside, by = of.model_outside or 0.0, ", by the reference" if of.excitation == "r" else ""
    fact = f"the model is outside at {100 * outside:.0f} % of {of.frequencies} frequencies{entries}{by}"
    found = kind.found(fact, where="frequency_response.csv", model_outside=outside)
    return [found, *BIASED.when(of.caveat, where="r")]


@finding(
    DOUBT,
    "response-contradicts-model",
    "Check whether the data come from a loop, the plant is linear, and all inputs are recorded.",
)
def contradicted(kind: FindingKind, of: MeasuredLines) -> list[Finding]:
    """The data contradict G of the model. At many frequencies it lies far outside the 95 % discs."""
    far, here = of.model_far_outside or 0.0, "frequency_response.csv"
    fact = f"it is outside of the 95 % discs, by a fifth of |G|, at {100 * far:.0f} % of the frequencies"
    return kind.when(not of.caveat and far >= _MOST_FAR, fact, where=here, model_far_outside=far)


@finding(DOUBT, "unexcited-lines", "Apply the signal of the spec, and record the applied inputs.")
def unexcited_lines(
    kind: FindingKind, units: Units, frequencies: Array, excited: NDArray[np.bool_]
) -> list[Finding]:
    """The inputs do not excite some lines of the spec. The response is not measured there.

    Args:
        frequencies: (L,), in rad/sample.
    """
    lacking = frequencies[~excited] / units.frequency
    if not lacking.size:
        return []
    lines, asked, first = int(lacking.size), int(excited.size), float(lacking[0])
    fact = f"{lines} of {asked} lines, the first at {first:.4g} {units.per_time}"
    return [kind.found(fact, lines=lines, asked=asked, first=first)]


@finding(DOUBT, "inputs-do-not-repeat", "Apply the signal of the spec, and record the applied inputs.")
def inputs_do_not_repeat(kind: FindingKind, differing: float, period: int) -> list[Finding]:
    """The inputs differ from period to period. More than half of their power does not repeat.

    Args:
        differing: the share of power that differs.
    """
    fact = f"{100.0 * differing:.3g} % of their power, in periods of {period} samples"
    return kind.when(differing > UNLIKE, fact, share=differing, period=period)


@finding(NOTE, "samples-before-periods", "Record whole periods.")
def samples_before_periods(kind: FindingKind, samples: int, periods: Periods) -> list[Finding]:
    """Samples before the first whole period are left out. The record is no multiple of the period."""
    left = samples - periods.each(samples) * periods.blocks * periods.period
    fact = f"the first {left} of {samples}, and the others are whole periods of {periods.period}"
    return kind.when(left, fact, samples=left, period=periods.period)


@finding(NOTE, "periods-between-gaps", "Record without gaps, if more are needed.")
def periods_between_gaps(kind: FindingKind, pieces: int, taken: int, period: int) -> Finding:
    """Only periods without a gap count. They are the whole periods of one phase after the transient."""
    fact = f"{taken} periods of {period} samples, in {pieces} pieces without gaps"
    return kind.found(fact, pieces=pieces, periods=taken, period=period)


@finding(DOUBT, "start-shifts-response", "Raise `accuracy.frequency_response.transient`, or the period.")
def start_shifts(kind: FindingKind, shift: float) -> list[Finding]:
    """The start of the record biases the response. Periods that count still contain the transient.

    Args:
        shift: in standard deviations.
    """
    fact = f"by up to {shift:.2g} standard deviations"
    return kind.when(shift > _SHIFTED, fact, where=_TRANSIENT, shift=shift)


@finding(DOUBT, "noise-leaks", "Allow a little more power, or take a few more periods.")
def noise_leaks(kind: FindingKind, ratio: float) -> list[Finding]:
    """Leakage of noise exceeds the required accuracy. The limits forbid the power that compensates it.

    Args:
        ratio: of the deviation of a record to the admissible one.
    """
    fact = f"the deviation is {ratio:.7g} times the admissible one"
    return kind.when(ratio > 1.0 + _ROUNDING, fact, where="limits", ratio=ratio)


@finding(NOTE, "record-of-whole-periods", "Choose a number of samples that is a multiple of the period.")
def record_of_whole_periods(
    kind: FindingKind, samples: int, asked: int, periods: int, period: int
) -> list[Finding]:
    """The record is shorter than the experiment. For a frequency response it consists of whole periods."""
    fact = f"{samples} of {asked} samples, {periods} periods of {period}"
    return kind.when(samples < asked, fact, where="experiment.samples", samples=samples, asked=asked)
