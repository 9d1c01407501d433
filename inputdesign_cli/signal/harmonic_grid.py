"""Choose the harmonics of a period at which a frequency response is measured, and the silent ones.

Excited at odd harmonics, an even nonlinearity responds at even ones, an odd one at odd ones. Odd random grids
([pintelon-schoukens-2012], Section 4.3) leave out one of each group of odd harmonics at random.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

Harmonics = NDArray[np.int_]


class TooFewHarmonicsError(ValueError):
    """Raised where a period has no more than `there` harmonics where more were asked for."""

    def __init__(self, there: int) -> None:
        super().__init__(there)
        self.there = there


@dataclass(frozen=True)
class HarmonicGrid:
    """Holds excited harmonics (L,) of a period, and the unexcited ones, odd and even, that are watched."""

    period: int
    excited: Harmonics
    odd: Harmonics
    even: Harmonics

    @property
    def frequencies(self) -> Array:
        """Return the frequencies (L,) of the lines, in rad/sample."""
        return self.at(self.excited)

    def at(self, harmonics: Harmonics) -> Array:
        """Return the frequencies of harmonics in rad/sample."""
        return np.asarray(2.0 * np.pi * harmonics / self.period)

    @classmethod
    def of(cls, period: int, excited: Harmonics, *, watched: bool) -> HarmonicGrid:
        """Return the grid of these lines; `watched`: between them all harmonics that are not excited."""
        between = np.arange(excited[0], excited[-1] + 1) if watched else np.zeros(0, dtype=int)
        silent = np.setdiff1d(between, excited)
        return cls(period, excited, silent[silent % 2 == 1], silent[silent % 2 == 0])


def thinned(candidates: Harmonics, group: int, rng: np.random.Generator) -> Harmonics:
    """Return the candidates without one, at random, of each whole group of `group` candidates."""
    whole = candidates.size // group
    return np.asarray(np.delete(candidates, np.arange(whole) * group + rng.integers(group, size=whole)))


def nearest_harmonics(period: int, frequencies: Array, *, odd: bool) -> Harmonics:
    """Return the harmonics next to frequencies in rad/sample, within (0, pi), as (L,)."""
    step = 2 if odd else 1
    highest = _highest(period, odd)
    nearest = np.rint((frequencies * period / (2.0 * np.pi) - 1.0) / step).astype(int) * step + 1
    return np.clip(nearest, 1, max(highest, 1))


def harmonics_between(period: int, band: tuple[float, float], lines: int | None, *, odd: bool) -> Harmonics:
    """Return `lines` harmonics in a band (rad/sample), as even in the logarithm as can be; None: all.

    Raises:
        TooFewHarmonicsError: the band has fewer.
    """
    step = 2 if odd else 1
    lo, hi = (edge * period / (2.0 * np.pi) for edge in band)
    inside = np.arange(1, _highest(period, odd) + 1, step)
    inside = inside[(inside >= lo * (1.0 - 1e-9)) & (inside <= hi * (1.0 + 1e-9))]
    if inside.size < (lines or 1):
        raise TooFewHarmonicsError(inside.size)
    if lines is None:
        return inside
    wanted = np.geomspace(inside[0], inside[-1], lines)
    places = np.rint((wanted - inside[0]) / step).astype(int)
    ramp = np.arange(lines)
    # Each is at least one place beyond its predecessor, and leaves places for the rest.
    places = np.maximum.accumulate(places - ramp) + ramp
    return inside[np.minimum(places, inside.size - lines + ramp)]


def _highest(period: int, odd: bool) -> int:
    """Return the last harmonic below pi."""
    highest = (period - 1) // 2
    return highest - 1 if odd and highest % 2 == 0 else highest
