"""Outputs answer at lines that are not excited, and a nonlinearity changes a measured frequency response."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, Severity, doubt, unsure
from inputdesign_cli.identification.nonlinearity import Cubes, SilentLines
from inputdesign_cli.outcome.units import Units

# Silent lines are worth a finding below this probability, times the number of tests.
_SPEAKS = 0.01
# A response that a nonlinearity would change by much is doubted earlier, by the odd lines alone.
_DOUBT = 0.05
# The two tests of odd lines: their power, and their likeness to a cube.
_WAYS = 2
MATTERS = 0.5
"""From this share of what is admitted on, a quarter in mean square, a change leaves a verdict open."""

SILENT_LINES = doubt(
    "silent-lines-answer",
    "Outputs answer at lines that are not excited. A linear plant answers only at the lines of its input. A "
    "nonlinearity of odd degree answers at odd harmonics, one of even degree at even ones. An F test "
    "compares the power there with the noise.",
    "Look at the plant for saturation, dead zones and backlash. See whether the input was applied as "
    "recorded.",
)
NONLINEAR = unsure(
    "nonlinear-response",
    "A nonlinearity changes the measured response. Odd lines that are not excited show by how much a "
    "nonlinearity of odd degree changes the response. From half of what is admitted on, the response is not "
    "called met.",
    "Measure at a smaller amplitude, or with other phases, and see whether the response stays. More periods "
    "do not help.",
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
    figures = {"share": found.share, "frequency": frequency, "cubed": found.cubed or None}
    return [NONLINEAR.found(message, severity=severity, **figures, probability=found.probability)]
