"""The settings that turn a spectrum into a record, and their demands on its length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.sinusoids import Selection

Phases = Literal["orthogonal", "random", "schroeder", "optimised", "even"]
LineVectors = Literal["orthogonal", "random"]


@dataclass(frozen=True)
class Quantiser:
    """A converter of 2^bits values, `step` apart, that spans [-span, span - step].

    Deviations are counted from the operating point, which is the converter's value nearest to `offset`.
    """

    bits: int
    span: float
    offset: float = 0.0

    @property
    def step(self) -> float:
        """Return the least significant bit, in the unit of u."""
        return 2.0 * self.span / 2.0**self.bits

    @property
    def operating_point(self) -> float:
        """Return the value of the converter nearest to the offset."""
        return self.step * self._centre

    @property
    def _centre(self) -> float:
        half = 2.0 ** (self.bits - 1)
        return float(np.clip(np.floor(self.offset / self.step + 0.5), -half, half - 1))

    def reach(self) -> float:
        """Return the largest deviation that the converter reaches to both sides."""
        half = 2.0 ** (self.bits - 1)
        return self.step * min(half - 1 - self._centre, self._centre + half)

    def steps(self, deviation: Array) -> Array:
        """Return the nearest deviations that the converter has, in steps."""
        half = 2.0 ** (self.bits - 1)
        nearest = np.floor(deviation / self.step + 0.5)
        return np.clip(nearest, -half - self._centre, half - 1 - self._centre)


@dataclass(frozen=True)
class SignalSettings:
    """Holds the settings of the signal to generate.

    Args:
        method: the name of a kind, see `kinds.py`.
        phases: for a multisine. `orthogonal`: uniform, with vectors across the inputs that make the matrix
            spectrum exact over as many periods as inputs; so do `schroeder` and `optimised`. `random`:
            uniform and independent in each input, exact on average only. `even`: optimised from Schroeder's.
        lines: harmonics of a period that are used.
        periods: the number of equal periods in the record.
        hold: each value stands for this many samples.
        tolerance, seconds: a search for the best record ends this near to the bound over all records, or
            after this time.
        ramp: samples over which the record fades in and out.
        returns: whether its last value is zero, the operating point.
        bits: length of the register of a pseudo-random sequence.
        number: number of levels of steps.
        level: (r,) the required peaks of the inputs, whatever accuracy follows.
        candidates, most_candidates: records to try; after the first number, up to the second while the best
            costs more than a twentieth beyond the design.
    """

    method: str = "filtered_noise"
    phases: Phases = "orthogonal"
    lines: Selection = None
    periods: int = 1
    hold: int = 1
    tolerance: float = 0.02
    seconds: float = 10.0
    ramp: int = 0
    returns: bool = False
    bits: int | None = None
    number: int | None = None
    level: Array | None = None
    candidates: int = 20
    most_candidates: int = 80
    seed: int = 0

    @property
    def block(self) -> int:
        """Return the number of samples that divides the length of a record."""
        return self.periods * self.hold

    @property
    def vectors(self) -> LineVectors:
        """Return the distribution of lines of a multisine over the inputs, see `multisine_record`."""
        return "random" if self.phases == "random" else "orthogonal"

    def period(self, samples: int) -> int:
        """Return the number of values in a period."""
        return samples // self.block

    def taper(self, values: int) -> Array:
        """Return the fade in and out, half a cosine each, (values,)."""
        length = min(-(-self.ramp // self.hold), values // 2)
        edge = 0.5 - 0.5 * np.cos(np.pi * (np.arange(length) + 1.0) / (length + 1.0))
        return np.concatenate([edge, np.ones(values - 2 * length), edge[::-1]])
