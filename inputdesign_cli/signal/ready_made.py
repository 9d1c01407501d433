"""Signals that need no design: sequences, multisines, chirps and steps, and what each of them excites."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.harmonic_grid import harmonics_between
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.phases import low_peak_phases, schroeder_phases
from inputdesign_cli.signal.shift_register import shifted_sequences

# Of the largest line: smaller ones are rounding.
_EXCITED = 1e-9
_DIGITS = 13
_MIDDLE = (0.05, 0.95)
# With more lines, phases are not optimised: Schroeder's are nearly as good.
_OPTIMISED = 2000


def prbs(bits: int, samples: int, inputs: int, rng: np.random.Generator) -> Array:
    """(samples, inputs) of +1 and -1, of period 2^bits - 1, inputs shifted by equal parts of it."""
    return shifted_sequences(bits, samples, inputs, rng)


def multisine(
    period: int,
    inputs: int,
    band: tuple[float, float],
    lines: int | None,
    rng: np.random.Generator,
    *,
    odd: bool,
) -> Array:
    """(period inputs, inputs) up to 1: equal lines of a low peak, in a band in rad/sample.

    One period for each input, over which the inputs are orthogonal.

    Raises:
        TooFewHarmonicsError: the band has fewer harmonics than lines.
    """
    harmonics = harmonics_between(period, band, lines, odd=odd)
    powers = np.broadcast_to(np.eye(inputs, dtype=complex), (harmonics.size, inputs, inputs))
    grid = Lines(2.0 * np.pi * harmonics / period, powers, period)
    angles = schroeder_phases(grid, period * inputs)
    if harmonics.size <= _OPTIMISED:
        angles = low_peak_phases(grid, period * inputs, angles)
    u = multisine_record(grid, period * inputs, rng, "orthogonal", angles=angles)
    return np.asarray(u / np.abs(u).max())


def chirp(samples: int, band: tuple[float, float]) -> Array:
    """(samples, 1) up to 1: a sinusoid whose frequency (rad/sample) rises evenly over the band."""
    import scipy.signal  # only now: see `plant.filtering`

    t = np.arange(samples, dtype=float)
    lo, hi = (edge / (2.0 * np.pi) for edge in band)
    u = np.asarray(scipy.signal.chirp(t, lo, float(samples), hi, phi=-90.0))[:, None]
    return np.asarray(u / np.abs(u).max())  # samples may miss the peaks


def steps(number: int, samples: int, inputs: int, rng: np.random.Generator) -> Array:
    """Return (samples, inputs) from -1 to 1: `number` even levels, each for as long, in random order."""
    levels = np.linspace(-1.0, 1.0, number)
    which = np.minimum(np.arange(samples) * number // samples, number - 1)
    return np.stack([rng.permutation(levels)[which] for _ in range(inputs)], axis=1)


@dataclass(frozen=True)
class Excites:
    """What a channel excites, its mean left out, if it goes on as it is.

    Attributes:
        order: of persistent excitation, the lines of its spectrum on the whole circle ([ljung-1999],
            Section 13.2).
        band: in rad/sample, with 5 % of the power below and 5 % above.
    """

    mean: float
    power: float
    peak: float
    order: int
    band: tuple[float, float]

    @property
    def crest_factor(self) -> float:
        """The peak over the root of the power; one where nothing moves."""
        return self.peak / float(np.sqrt(self.power)) if self.power else 1.0


def excites(u: Array) -> list[Excites]:
    """What the channels of a record (N, r) excite, all of its samples looked at."""
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
    """A record (N, r) from -1 to 1 taken to a least and a largest value of each channel."""
    low, high = np.array(levels).T
    values = 0.5 * (low + high) + 0.5 * (high - low) * u
    # Rounding in the last digits would be written, as 56.00000000000001.
    digits = _DIGITS - np.ceil(np.log10(np.maximum(np.abs(low), np.abs(high)))).astype(int)
    rounded = [np.round(one, digit) for one, digit in zip(values.T, digits.tolist(), strict=True)]
    return np.asarray(np.clip(np.stack(rounded, axis=1), low, high))
