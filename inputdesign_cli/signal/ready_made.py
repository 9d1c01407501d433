"""Signals that need no design: equal lines of any kind, and the excitation by records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.harmonic_grid import harmonics_between
from inputdesign_cli.signal.kind import Draft
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.settings import SignalSettings

# Lines below this share of the largest are rounding.
_EXCITED = 1e-9
_DIGITS = 13
_MIDDLE = (0.05, 0.95)


def equal_lines(
    settings: SignalSettings,
    samples: int,
    inputs: int,
    band: tuple[float, float] = (0.0, np.pi),
    lines: int | None = None,
    *,
    odd: bool = False,
) -> Array:
    """Return one period of equal lines in a band in rad/sample, of a kind, up to 1, (samples, inputs).

    Raises:
        TooFewHarmonicsError: the band has fewer harmonics than lines.
    """
    kind = kind_of(settings.method)
    period = samples // kind.blocks(settings, inputs)
    harmonics = np.ones(1) if kind.flat else harmonics_between(period, band, lines, odd=odd)
    powers = np.broadcast_to(np.eye(inputs, dtype=complex), (harmonics.size, inputs, inputs))
    draft = Draft(Lines(2.0 * np.pi * harmonics / period, powers, period), samples, settings, band)
    u = kind.draw(draft, np.random.default_rng(settings.seed))
    return np.asarray(u / (np.abs(u).max() or 1.0))


@dataclass(frozen=True)
class Excites:
    """Holds the excitation by a channel without its mean, if the record repeats periodically.

    Attributes:
        order: the order of persistent excitation, the number of lines of its spectrum on the whole circle
            ([ljung-1999], Section 13.2).
        band: the band in rad/sample, with 5 % of the power below and 5 % above.
    """

    mean: float
    power: float
    peak: float
    order: int
    band: tuple[float, float]

    @property
    def crest_factor(self) -> float:
        """Return the peak over the root of the power; one where nothing moves."""
        return self.peak / float(np.sqrt(self.power)) if self.power else 1.0


def excites(u: Array) -> list[Excites]:
    """Return the excitation by each channel of a record (N, r), from all of its samples."""
    found = []
    for channel in u.T:
        mean = float(channel.mean())
        power = np.abs(np.fft.rfft(channel - mean)) ** 2
        power[1 : (len(channel) + 1) // 2] *= 2.0
        lines = np.flatnonzero(power > _EXCITED * max(power.max(), 1e-300))
        unit = 2.0 * np.pi / len(channel)
        ends = int(np.sum(2 * lines == len(channel)))
        share = np.cumsum(power) / max(power.sum(), 1e-300)
        low, high = (float(np.searchsorted(share, part)) for part in _MIDDLE)
        moving = channel - mean
        found.append(
            Excites(
                mean,
                float(np.mean(moving**2)),
                float(np.abs(moving).max()),
                2 * lines.size - ends if power.any() else 0,
                (unit * low, unit * high),
            )
        )
    return found


def scaled(u: Array, levels: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Return a record (N, r) from -1 to 1 scaled to a least and a largest value of each channel."""
    low, high = np.array(levels).T
    values = 0.5 * (low + high) + 0.5 * (high - low) * u
    # Rounding of the last digits would appear in files, as 56.00000000000001.
    digits = _DIGITS - np.ceil(np.log10(np.maximum(np.abs(low), np.abs(high)))).astype(int)
    rounded = [np.round(one, digit) for one, digit in zip(values.T, digits.tolist(), strict=True)]
    return np.asarray(np.clip(np.stack(rounded, axis=1), low, high))
