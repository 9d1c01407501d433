"""Periods of a measured response differ by spikes, a drift or chance, or a nonlinearity changes it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, Severity, doubt, unsure
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.faults import Spikes
from inputdesign_cli.identification.nonlinearity import Cubes, SilentLines
from inputdesign_cli.identification.periodic_response import PeriodDrift
from inputdesign_cli.outcome.units import Units

# Silent lines are worth a finding below this probability, times the number of tests.
_SPEAKS = 0.01
# A response that a nonlinearity would change by much is doubted earlier, by the odd lines alone.
_DOUBT = 0.05
# The two tests of odd lines: their power, and their likeness to a cube.
_WAYS = 2
MATTERS = 0.5
"""From this share of the admissible error on, a quarter in mean square, a change leaves a verdict open."""

SILENT_LINES = doubt(
    "silent-lines-answer",
    "Outputs respond at lines that are not excited. A linear plant does not. Odd nonlinearities respond at "
    "odd harmonics, even ones at even harmonics. An F test compares the power there with the noise.",
    "Look for saturation, dead zones and backlash. Check that the input was applied as recorded.",
)
NONLINEAR = unsure(
    "nonlinear-response",
    "A nonlinearity changes the measured response. Odd lines without excitation show by how much. From half "
    "of the admissible error on, the response does not count as met.",
    "Measure at a smaller amplitude, or with other phases. More periods do not help.",
    "nonlinearity",
)


@dataclass(frozen=True)
class Distorted:
    """The largest change of a response by a nonlinearity of odd degree, over the admissible error.

    Attributes:
        shares: (L,), at every line.
        probability: that noise alone has as much at the silent lines.
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
        shares: by the power at silent lines.
        of_cube: shares by the cubes of the outputs that have a one in (p,).
    """
    power, like = (_of_any(probability) for probability in (silent["odd"].probability, cube.probability))
    alike = _WAYS * cube.probability.size * cube.probability < _DOUBT
    cubed = of_cube(alike.astype(float))
    both = np.maximum(np.where(power < _DOUBT, shares, 0.0), cubed) if alike.any() else shares
    line, signal = int(np.argmax(both)), ""
    if cubed[line] > 0.0 and cubed[line] >= both[line]:
        output = int(np.argmin(cube.probability))
        source = int(cube.source[output])
        signal = f"y{output + 1}" if source < 0 else f"u{source + 1}"
    found = Distorted(np.asarray(both), min(power, like), signal)
    small = min(_chance(silent, "odd"), like) < _SPEAKS
    return found if (min(power, like) < _DOUBT if found.matters else small) else None


def _of_any(probability: Array) -> float:
    """Return the probability that noise alone has as much at any output, in either test."""
    return min(_WAYS * float(probability.min()) * probability.size, 1.0)


def _chance(silent: Mapping[str, SilentLines], kind: str) -> float:
    """Return the probability that any silent line has by noise alone as much as lines of this kind."""
    tests = sum(found.probability.size for found in silent.values())
    return min(float(silent[kind].probability.min()) * tests, 1.0)


def silent_lines_answer(silent: Mapping[str, SilentLines]) -> list[Finding]:
    """Return a finding for each kind of lines, odd or even, with more than noise."""
    seen = []
    for kind, found in silent.items():
        chance, rms = _chance(silent, kind), ", ".join(f"{value:.3g}" for value in found.rms)
        message = (
            f"the outputs answer at {kind} lines that are not excited (rms {rms}, probability of chance "
            f"{chance:.2g}). Either a nonlinearity of {kind} degree acts, or an input was not applied as "
            "recorded"
        )
        if chance < _SPEAKS:
            seen.append(SILENT_LINES.found(message, where=kind, probability=chance, rms=found.rms.tolist()))
    return seen


def nonlinear_response(
    units: Units, found: Distorted | None, w: Array, *, decided: bool = False
) -> list[Finding]:
    """Return a finding on the change of a response at lines w (L,), in the unit of the user.

    Args:
        decided: whether noise alone decides already.
    """
    if found is None:
        return []
    frequency, severity = float(w[found.line]), Severity.NOTE
    change = f"about {found.share:.2g} of what is admitted, at {frequency:.3g} {units.per_time}"
    message = f"a nonlinearity changes the response by little: {change}"
    if found.matters:
        severity = Severity.DOUBT if decided else Severity.UNDECIDED
        cause = f"the cube of {found.cubed}" if found.cubed else "a nonlinearity"
        message = (
            f"{cause} changes the response by {change}. Odd lines that are not excited show it (probability "
            f"of chance {found.probability:.2g}). More periods do not help: measure at a smaller amplitude, "
            "or with other phases, and see whether the response stays"
        )
    share, cubed, p = found.share, found.cubed or None, found.probability
    return [
        NONLINEAR.found(
            message, severity=severity, share=share, frequency=frequency, cubed=cubed, probability=p
        )
    ]


SPIKES = unsure(
    "spiked-periods",
    "A few samples dominate the differences between periods. They hold most of the squared deviations from "
    "the median of the periods. No verdict is possible.",
    "Empty the faulty cells, and assess again.",
    "spikes",
)
DRIFT = unsure(
    "drifting-periods",
    "Outputs drift from period to period. The means of the periods follow a polynomial in time. Drift leaks "
    "into every line and changes the response or its scatter.",
    "Add `--detrend linear`, or subtract the slow trend from the column first.",
    "drift",
)
CHANCE = unsure(
    "response-within-chance",
    "The scatter of the periods leaves the verdict open. The admissible error lies between two limits for "
    "the true deviation (95 % for all lines together).",
    "Record as many periods as the finding names.",
    "chance",
)


def spiked_periods(
    units: Units, found: Sequence[Spikes], places: Sequence[str], samples: int, periods: int
) -> Iterator[Finding]:
    """Yield a finding for every output with spikes.

    Args:
        places: where the samples of each of them stand, in words.
        samples: of the record.
        periods: of the same phase; of two nobody knows which one is wrong.
    """
    either = ", one of each two a period apart" if periods == 2 else ""
    for one, place in zip(found, places, strict=True):
        name = signal_name("y", one.output, units.outputs)
        message = (
            f"spikes decide how the periods of {name} differ: {len(one.samples)} of {samples} samples (at "
            f"{place}{either}) hold {100 * one.share:.3g} % of the squares. Noise, nonlinearity and needed "
            "periods cannot be judged. Empty the cells that are faults of measurement, and assess again: "
            "the other whole periods count"
        )
        yield SPIKES.found(message, where=name, samples=list(one.samples), share=one.share)


def drifting_periods(
    units: Units, drift: PeriodDrift, moved: Array, w: Array, *, lined: bool
) -> list[Finding]:
    """Return a finding on a drift that changes the response enough to decide.

    Args:
        moved: (L,), the change over what is admitted, at frequencies w in the unit of the user.
        lined: whether a line was taken away already.
    """
    at = int(np.argmax(moved))
    share, frequency = float(moved[at]), float(w[at])
    moving = np.flatnonzero(drift.degree).tolist()
    sizes = {signal_name("y", i, units.outputs): float(np.ptp(drift.curve[:, i])) for i in moving}
    listed = " and ".join(f"{name} drifts by {size:.3g}" for name, size in sizes.items())
    straight = int(drift.degree.max()) == 1 and not lined
    remedy = "add --detrend linear" if straight else "subtract its course, which is no line, from the column"
    message = (
        f"{listed} over the record, by the means of the periods. This changes the response, or its scatter, "
        f"by up to {share:.2g} of what is admitted, at {frequency:.3g} {units.per_time}. Neither more "
        f"periods nor another amplitude helps: {remedy}, and assess again"
    )
    where = ", ".join(sizes)
    found = DRIFT.found(
        message, where=where, drift=sizes, share=share, frequency=frequency, straight=straight
    )
    return [found] if share >= MATTERS else []


def within_chance(
    units: Units, ratio: float, limits: tuple[float, float], frequency: float, enough: str
) -> Finding:
    """Return the finding that limits of the largest deviation over the admitted one enclose 1.

    Args:
        frequency: of the largest ratio, in the unit of the user.
        enough: how many periods are needed, in words.
    """
    message = (
        f"the largest deviation is {ratio:.4g} of what is admitted, at {frequency:.4g} {units.per_time}. By "
        f"chance the true one may lie between {limits[0]:.3g} and {limits[1]:.3g}: {enough}"
    )
    return CHANCE.found(message, ratio=ratio, limits=limits, frequency=frequency)
