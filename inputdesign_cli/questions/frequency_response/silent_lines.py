"""What lines without excitation say of a plant, in the result and in sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.identification.cubes import Cubes
from inputdesign_cli.identification.silent_lines import SilentLines
from inputdesign_cli.outcome.results import Array, Json

# Silent lines speak where the smallest probability, times how many there are, is below this.
_SPEAKS = 0.01
# Less is enough to doubt a response that a nonlinearity would change by much: the odd lines, by themselves.
_DOUBT = 0.05
# By their power, and by how much they are like a cube.
_WAYS = 2
MATTERS = 0.5
"""From this share of what is admitted on, a quarter in mean square, a nonlinearity leaves a verdict open."""


@dataclass(frozen=True)
class Distorted:
    """What a nonlinearity of odd degree does to a response: at most this share of what is admitted.

    Attributes:
        shares: (L,), that at every line.
        probability: that noise alone has as much at the silent lines.
        cubed: what the silent lines have the cube of, such as u1; empty where their power alone tells.
    """

    shares: Array
    probability: float
    cubed: str

    @property
    def line(self) -> int:
        """That of the largest share."""
        return int(np.argmax(self.shares))

    @property
    def share(self) -> float:
        """The largest share."""
        return float(self.shares[self.line])

    @property
    def matters(self) -> bool:
        """Whether it may decide on what is met."""
        return self.share >= MATTERS


def distorted(
    silent: Mapping[str, SilentLines], shares: Array, cube: Cubes, of_cube: Callable[[Array], Array]
) -> Distorted | None:
    """From the error of G over what is admitted (L,); None where odd lines have what noise has.

    Args:
        shares: by the power at silent lines.
        of_cube: those by the cubes of outputs with a one (p,).
    """
    power, like = (_ofany(probability) for probability in (silent["odd"].probability, cube.probability))
    alike = _WAYS * cube.probability.size * cube.probability < _DOUBT
    cubed = of_cube(alike.astype(float))
    both = np.maximum(np.where(power < _DOUBT, shares, 0.0), cubed) if alike.any() else shares
    line = int(np.argmax(both))
    told = ""
    if cubed[line] > 0.0 and cubed[line] >= both[line]:
        output = int(np.argmin(cube.probability))
        source = int(cube.source[output])
        told = f"y{output + 1}" if source < 0 else f"u{source + 1}"
    found = Distorted(np.asarray(both), min(power, like), told)
    small = min(_chance(silent, "odd"), like) < _SPEAKS
    return found if (min(power, like) < _DOUBT if found.matters else small) else None


def _ofany(probability: Array) -> float:
    """That noise alone has as much at any output, in either way to look."""
    return min(_WAYS * float(probability.min()) * probability.size, 1.0)


def _chance(silent: Mapping[str, SilentLines], kind: str) -> float:
    """That any of all lines has by noise alone as much as those of a kind have at some output."""
    tests = sum(found.probability.size for found in silent.values())
    return min(float(silent[kind].probability.min()) * tests, 1.0)


def silent_entry(silent: Mapping[str, SilentLines]) -> dict[str, Json]:
    """`nonlinearity` of the result, by kind of the lines: odd and even; lists are by output."""
    return {
        kind: {
            "lines": found.lines,
            "over_noise": found.over_noise.tolist(),
            "probability": found.probability.tolist(),
            "rms": found.rms.tolist(),
        }
        for kind, found in silent.items()
    }


def silent_notes(silent: Mapping[str, SilentLines]) -> list[str]:
    """A sentence for each kind of lines that speaks."""
    notes = []
    for kind, found in silent.items():
        chance = _chance(silent, kind)
        if chance < _SPEAKS:
            level = ", ".join(f"{value:.3g}" for value in found.rms)
            notes.append(
                f"the outputs answer at {kind} lines that are not excited (rms {level}, probability of "
                f"chance {chance:.2g}): a nonlinearity of {kind} degree, or an input that was not applied as "
                "recorded"
            )
    return notes
