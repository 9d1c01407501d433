"""A frequency response from data or for a design: what counts, what was not measured, and what changes it.

Periods of a measured response differ by spikes, a drift or chance; a nonlinearity changes it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, UNDECIDED, Finding, FindingKind, doubt, finding
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.faults import Spikes
from inputdesign_cli.identification.nonlinearity import Cubes, SilentLines
from inputdesign_cli.identification.periodic_response import PeriodDrift, Periods
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.units import Units

# The share of frequencies far outside the discs that contradicts a model.
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
# Silent lines are worth a finding below this probability, times the number of tests.
_SIGNIFICANT = 0.01
# A nonlinearity that would change the response by much is reported below this probability of the odd lines.
_DOUBT = 0.05
# The two tests of odd lines: their power, and their likeness to a cube.
_WAYS = 2
MATTERS = 0.5
"""From this share of the admissible error on, a quarter in mean square, a change leaves a verdict open."""
_TRANSIENT = "accuracy.frequency_response.transient"

BIASED = doubt(
    "response-biased-by-loop",
    "The response without a model is biased towards -1/C. The reference of the loop is not recorded. Where "
    "noise is strong, the ratio of y to u shows the inverse controller.",
    "Record the reference as column r.",
)


@finding(NOTE, "response-without-model", "Compare it with the model in `frequency_response.csv`.")
def response_note(kind: FindingKind, of: MeasuredLines) -> list[Finding]:
    """The frequency response was measured without a model. Even a right model misses 5 % of the discs."""
    outside, by = of.model_outside or 0.0, ", measured from the reference r" * (of.excitation == "r")
    fact = f"the model is outside at {100 * outside:.0f} % of {of.frequencies} frequencies{by}"
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
        ratio: ratio of the deviation of a record to the admissible one.
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


@dataclass(frozen=True)
class Distorted:
    """The largest change of a response by a nonlinearity of odd degree, over the admissible error.

    Attributes:
        shares: (L,), at every line.
        probability: the probability that noise alone has as much at the silent lines.
        cubed: the signal, for example u1, whose cube the silent lines resemble; empty if the shares rest on
            the power alone.
    """

    shares: Array
    probability: float
    cubed: str

    @property
    def line(self) -> int:
        """Return the line of the largest share."""
        return int(np.argmax(self.shares))

    @property
    def share(self) -> float:
        """Return the largest share."""
        return float(self.shares.max())

    @property
    def matters(self) -> bool:
        """Return whether the share is large enough to affect a verdict."""
        return self.share >= MATTERS


def distorted(
    silent: Mapping[str, SilentLines], shares: Array, cube: Cubes, of_cube: Callable[[Array], Array]
) -> Distorted | None:
    """Return the error of G over the admissible one (L,); None if odd lines contain no more than noise.

    Args:
        shares: (L,), the error by the power at silent lines.
        of_cube: returns the error by the cubes of the outputs that have a one in (p,).
    """
    # The probability that noise alone has as much at any output, in either test.
    each = silent["odd"].probability, cube.probability
    power, like = (min(_WAYS * float(one.min()) * one.size, 1.0) for one in each)
    alike = _WAYS * cube.probability.size * cube.probability < _DOUBT
    cubed = of_cube(alike.astype(float))
    both = np.maximum(np.where(power < _DOUBT, shares, 0.0), cubed) if alike.any() else shares
    line, signal = int(np.argmax(both)), ""
    if cubed[line] > 0.0 and cubed[line] >= both[line]:
        output = int(np.argmin(cube.probability))
        source = int(cube.source[output])
        signal = f"y{output + 1}" if source < 0 else f"u{source + 1}"
    found = Distorted(np.asarray(both), min(power, like), signal)
    small = min(_chance(silent, "odd"), like) < _SIGNIFICANT
    return found if (min(power, like) < _DOUBT if found.matters else small) else None


def _chance(silent: Mapping[str, SilentLines], kind: str) -> float:
    """Return the probability that any silent line has by noise alone as much as lines of this kind."""
    tests = sum(found.probability.size for found in silent.values())
    return min(float(silent[kind].probability.min()) * tests, 1.0)


@finding(
    DOUBT,
    "silent-lines-answer",
    "Look for saturation, dead zones and backlash. Check that the input was applied as recorded.",
)
def silent_lines_answer(kind: FindingKind, silent: Mapping[str, SilentLines]) -> list[Finding]:
    """Outputs respond at lines that are not excited. A linear plant does not.

    Odd nonlinearities respond at odd harmonics, even ones at even harmonics. An F test compares the power
    there with the noise.
    """
    seen = []
    for parity, found in silent.items():
        chance, rms = _chance(silent, parity), ", ".join(f"{value:.3g}" for value in found.rms)
        fact = f"{parity} lines have rms {rms} (probability of chance {chance:.2g})"
        seen += kind.when(
            chance < _SIGNIFICANT, fact, where=parity, probability=chance, rms=found.rms.tolist()
        )
    return seen


@finding(
    UNDECIDED,
    "nonlinear-response",
    "Measure at a smaller amplitude, or with other phases. More periods do not help.",
    "nonlinearity",
)
def nonlinear_response(
    kind: FindingKind, units: Units, found: Distorted | None, w: Array, *, decided: bool = False
) -> list[Finding]:
    """A nonlinearity changes the measured response. Odd lines without excitation show by how much.

    From half of the admissible error on, the response does not count as met.

    Args:
        w: (L,), the lines, in the unit of the user.
        decided: whether noise alone decides already.
    """
    if found is None:
        return []
    frequency, p = float(w[found.line]), found.probability
    fact = f"about {found.share:.2g} of the admissible error, at {frequency:.3g} {units.per_time}"
    fact += f", by the cube of {found.cubed}" if found.cubed else ""
    severity = NOTE if not found.matters else DOUBT if decided else UNDECIDED
    figures = {"share": found.share, "frequency": frequency, "cubed": found.cubed or None, "probability": p}
    said = kind.found(f"{fact} (probability of chance {p:.2g})", severity=severity)
    return [replace(said, figures=figures)]


@finding(
    UNDECIDED, "spiked-periods", "Empty the faulty cells, and assess again; of two periods, both.", "spikes"
)
def spiked_periods(
    kind: FindingKind, units: Units, found: Sequence[Spikes], places: Sequence[str]
) -> list[Finding]:
    """A few samples dominate the differences between periods. No verdict is possible.

    Args:
        places: the places of the samples of each, in words.
    """
    spiked = []
    for one, place in zip(found, places, strict=True):
        name = signal_name("y", one.output, units.outputs)
        fact = f"{name} at {place}, with {100 * one.share:.3g} % of the squares"
        spiked.append(kind.found(fact, where=name, samples=list(one.samples), share=one.share))
    return spiked


@finding(UNDECIDED, "drifting-periods", "Subtract the trend first, as by `--detrend linear`.", "drift")
def drifting_periods(
    kind: FindingKind, units: Units, drift: PeriodDrift, moved: Array, w: Array, *, lined: bool
) -> list[Finding]:
    """Outputs drift from period to period. Drift leaks into every line and changes the response.

    Args:
        moved: (L,), the change over the admissible error, at frequencies w in the unit of the user.
        lined: whether a line was subtracted already.
    """
    at = int(np.argmax(moved))
    share, frequency = float(moved[at]), float(w[at])
    moving = np.flatnonzero(drift.degree).tolist()
    sizes = {signal_name("y", i, units.outputs): float(np.ptp(drift.curve[:, i])) for i in moving}
    listed = " and ".join(f"{name} drifts by {size:.3g}" for name, size in sizes.items())
    straight = int(drift.degree.max()) == 1 and not lined
    fact = (
        f"{listed}. The response, or its scatter, changes by up to {share:.2g} of the admissible error, at "
        f"{frequency:.3g} {units.per_time}"
    )
    return kind.when(
        share >= MATTERS,
        fact,
        where=", ".join(sizes),
        remedy="Add --detrend linear." if straight else "Subtract the drift, which is no line, first.",
        drift=sizes,
        share=share,
        frequency=frequency,
        straight=straight,
    )


@finding(UNDECIDED, "response-within-chance", "Record more periods; the message says how many.", "chance")
def within_chance(
    kind: FindingKind, units: Units, ratio: float, limits: tuple[float, float], frequency: float, enough: str
) -> Finding:
    """There are too few periods to decide. The noise was estimated from their scatter.

    The true deviation lies between two limits (95 %), and the admissible one is between them too.

    Args:
        ratio: the largest estimated deviation over the admissible one; `limits`: 95 % limits of the true one.
        frequency: the frequency of the largest ratio, in the unit of the user.
        enough: the number of periods needed, in words.
    """
    fact = (
        f"at {frequency:.4g} {units.per_time} the deviation is {ratio:.4g} of the admissible one, and the "
        f"true one is between {limits[0]:.3g} and {limits[1]:.3g} of it"
    )
    return kind.found(fact, remedy=f"{enough}.", ratio=ratio, limits=limits, frequency=frequency)
