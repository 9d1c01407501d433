"""Periods of a measured response differ by spikes, a drift or chance, or a nonlinearity changes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, UNDECIDED, Finding, FindingKind, finding
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
        seen += kind.when(chance < _SPEAKS, fact, where=parity, probability=chance, rms=found.rms.tolist())
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
    frequency, severity, remedy = float(w[found.line]), NOTE, "Nothing"
    fact = f"about {found.share:.2g} of the admissible error, at {frequency:.3g} {units.per_time}"
    if found.matters:
        severity, remedy = DOUBT if decided else UNDECIDED, ""
        fact += f", by the cube of {found.cubed}" if found.cubed else ""
        fact += f" (probability of chance {found.probability:.2g})"
    share, cubed, p = found.share, found.cubed or None, found.probability
    figures = {"share": share, "frequency": frequency, "cubed": cubed, "probability": p}
    return [replace(kind.found(fact, severity=severity, remedy=remedy), figures=figures)]


@finding(UNDECIDED, "spiked-periods", "Empty the faulty cells, and assess again.", "spikes")
def spiked_periods(
    kind: FindingKind,
    units: Units,
    found: Sequence[Spikes],
    places: Sequence[str],
    samples: int,
    periods: int,
) -> list[Finding]:
    """A few samples dominate the differences between periods. No verdict is possible.

    Args:
        places: where the samples of each of them stand, in words.
        samples: of the record.
        periods: of the same phase; of two nobody knows which one is wrong.
    """
    either = ", one of each two a period apart" if periods == 2 else ""
    spiked = []
    for one, place in zip(found, places, strict=True):
        name = signal_name("y", one.output, units.outputs)
        fact = (
            f"{len(one.samples)} of {samples} samples of {name} (at {place}{either}) hold "
            f"{100 * one.share:.3g} % of the squares"
        )
        spiked.append(kind.found(fact, where=name, samples=list(one.samples), share=one.share))
    return spiked


@finding(UNDECIDED, "drifting-periods", "Subtract the trend first, as by `--detrend linear`.", "drift")
def drifting_periods(
    kind: FindingKind, units: Units, drift: PeriodDrift, moved: Array, w: Array, *, lined: bool
) -> list[Finding]:
    """Outputs drift from period to period. Drift leaks into every line and changes the response.

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


@finding(UNDECIDED, "response-within-chance", "Record as many periods as the finding names.", "chance")
def within_chance(
    kind: FindingKind, units: Units, ratio: float, limits: tuple[float, float], frequency: float, enough: str
) -> Finding:
    """The scatter of the periods leaves the verdict open. The admissible error is within 95 % limits.

    Args:
        ratio: the largest one of a deviation to the admissible one; `limits`: of the true one.
        frequency: of the largest ratio, in the unit of the user.
        enough: how many periods are needed, in words.
    """
    fact = (
        f"the largest deviation is {ratio:.4g} of the admissible one, at {frequency:.4g} {units.per_time}, "
        f"and the true one between {limits[0]:.3g} and {limits[1]:.3g}"
    )
    return kind.found(fact, remedy=f"{enough}.", ratio=ratio, limits=limits, frequency=frequency)
