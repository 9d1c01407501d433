"""The protocol of a kind of signal, and the settings from which its records are drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.phases import LimitedResponse
from inputdesign_cli.signal.settings import SignalSettings

LimitedResponses = Callable[[Array], Sequence[LimitedResponse]]


@dataclass(frozen=True)
class Draft:
    """Holds the settings from which a period of a signal is drawn.

    Args:
        lines: the sinusoids of one of its blocks, with the wanted powers, in rad per value.
        samples: values of the period, all blocks together.
        band: the band of the excitation, in rad per value.
        limited: signals that optimised phases keep low, at frequencies in rad per value; None: the inputs.
    """

    lines: Lines
    samples: int
    settings: SignalSettings
    band: tuple[float, float] = (0.0, np.pi)
    limited: LimitedResponses | None = None


class SignalKind:
    """A kind of signal. Another package derives its own, and registers it (`signal/kinds.py`).

    Attributes:
        few_levels: whether limits lower all values by one factor, which keeps the levels few, without ramps.
        flat: whether its spectrum is flat over the band, whatever is wanted: only powers count.
        slewed: whether it moves between two levels as fast as a limit on moves allows.
        off_grid: whether sinusoids of a record without periods keep frequencies between harmonics.
        switched: whether better switching times of its two levels are searched if it misses the target.
        several: whether it serves several inputs at once.
    """

    few_levels = False
    flat = False
    slewed = False
    off_grid = False
    switched = False
    several = True

    @property
    def of_levels(self) -> bool:
        """Return whether the signal has few levels."""
        return self.few_levels or self.slewed

    def blocks(self, settings: SignalSettings, inputs: int) -> int:
        """Return the number of blocks, each with all lines, in a period."""
        return 1

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """Return a period (samples, r). Its level is chosen later, and does not matter."""
        raise NotImplementedError
