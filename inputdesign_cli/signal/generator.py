"""Records with a designed spectrum, of the kind that the settings ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.designed import DesignedSpectrum
from inputdesign_cli.signal.levels import few_levels
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import blocks_of, gaussian_record, multisine_record
from inputdesign_cli.signal.phases import LimitedResponse, low_peak_phases, schroeder_phases
from inputdesign_cli.signal.settings import Method, SignalSettings
from inputdesign_cli.signal.shift_register import register_length, shifted_sequences
from inputdesign_cli.signal.sinusoids import select
from inputdesign_cli.signal.spectral_factor import SpectralFactor, spectral_factor

# Beyond this relative error of its autocovariances a factor no longer has the designed spectrum.
_FACTOR_RESIDUAL = 1e-8

LimitedResponses = Callable[[Array], Sequence[LimitedResponse]]


@dataclass(frozen=True)
class SignalGenerator:
    """Makes records of `samples` samples, each from random numbers of its own; other processes can have it.

    Args:
        band: where white excitation has its power, in rad per sample.
        limited: what optimised phases keep low, at frequencies in rad per value; the inputs when None.
    """

    spectrum: DesignedSpectrum
    settings: SignalSettings
    samples: int
    band: tuple[float, float] = (0.0, np.pi)
    limited: LimitedResponses | None = None

    @cached_property
    def factor(self) -> SpectralFactor | None:
        """For filtered noise of one input whose spectrum is that of a moving average."""
        if self.settings.method != "filtered_noise" or self.spectrum.autocovariances is None:
            return None
        return spectral_factor(self.spectrum.autocovariances)

    @property
    def method(self) -> Method:
        """What is made.

        A multisine where noise was asked for, but the spectrum consists of sinusoids, or no spectral factor
        can be had to 1e-8 (a spectrum with deep zeros).
        """
        if self.settings.method != "filtered_noise":
            return self.settings.method
        unusable = self.factor is not None and self.factor.residual > _FACTOR_RESIDUAL
        return "multisine" if unusable or self.spectrum.sinusoids is not None else "filtered_noise"

    @property
    def period(self) -> int:
        """Values in one period of the record, all of its blocks."""
        return self.settings.period(self.samples)

    @cached_property
    def lines(self) -> Lines:
        """Return the lines of one block of values; a period of the signal consists of one or more blocks.

        Lines of a design of sinusoids keep their own frequencies in a multisine of single samples that is not
        repeated. Otherwise they move to the nearest harmonics.
        """
        settings, blocks = self.settings, 1
        if self.method == "multisine":
            blocks = blocks_of(self.settings.vectors, self.spectrum.inputs)
        elif self.method in ("binary", "slewed", "ternary"):
            blocks = self.spectrum.inputs
        block = self.period // blocks
        lines = self.spectrum.lines(block, settings.hold)
        if self.method == "multisine" and settings.block == 1 and settings.lines is None:
            return lines
        powers = select(lines.dense(block), settings.lines)
        if settings.hold > 1:
            powers = powers / self._hold_gain(block)[:, None, None]
        return Lines.of_period(powers, block)

    def values(self, rng: np.random.Generator) -> Array:
        """(samples // hold, r): one record, faded in and out, before each value is held."""
        settings = self.settings
        if self.factor is not None and self.method == "filtered_noise" and settings.periods == 1:
            whole = self.factor.filtered(self.samples, rng)[:: settings.hold, None]
        else:
            whole = np.tile(self._period(rng), (settings.periods, 1))
        return whole * settings.taper(len(whole))[:, None] if settings.ramp else whole

    def _period(self, rng: np.random.Generator) -> Array:
        method, lines, length = self.method, self.lines, self.period
        if method == "multisine":
            return multisine_record(
                lines, length, rng, self.settings.vectors, angles=self._phases(lines, rng)
            )
        if method == "binary" or method == "slewed":  # the ramps come with the limits
            return few_levels(lines, length, rng, "binary")
        if method == "ternary":
            return few_levels(lines, length, rng, "ternary")
        if method == "filtered_noise":
            return gaussian_record(lines, rng)
        if method == "white":
            return gaussian_record(self._white(lines), rng)
        if method == "prbs":
            bits = self.settings.bits or register_length(length)
            return shifted_sequences(bits, length, lines.inputs, rng) * np.sqrt(lines.mean_squares)
        raise ValueError("a given record is not drawn")

    def _phases(self, lines: Lines, rng: np.random.Generator) -> Array | None:
        """The common phases (L,) of the lines; None for uniform ones."""
        if self.settings.phases == "schroeder":
            return schroeder_phases(lines, self.period)
        if self.settings.phases != "optimised":
            return None
        start = 2.0 * np.pi * rng.random(lines.frequencies.size)
        limited = [] if self.limited is None else self.limited(lines.frequencies)
        return low_peak_phases(lines, self.period, start, limited=limited)

    def _hold_gain(self, block: int) -> Array:
        """(block // 2 + 1,): what holding each value k times does to the powers of the harmonics.

        |sum_{i<k} e^{-jwi} / k|^2, which is undone up to pi / k; what lies above is lost.
        """
        w = 2.0 * np.pi * np.arange(block // 2 + 1) / (block * self.settings.hold)
        return np.abs(np.exp(-1j * np.outer(w, np.arange(self.settings.hold))).mean(axis=1)) ** 2

    def _white(self, lines: Lines) -> Lines:
        """Flat over the band, each input with its designed power, not correlated."""
        harmonics = np.arange(self.period // 2 + 1)
        w = 2.0 * np.pi * harmonics / (self.period * self.settings.hold)
        inside = (w >= self.band[0] * (1 - 1e-9)) & (w <= self.band[1] * (1 + 1e-9))
        ends = (harmonics == 0) | (2 * harmonics == self.period)
        share = np.where(inside, np.where(ends, 0.5, 1.0), 0.0)
        share = share / max(float(share.sum()), 1e-300)
        return Lines.of_period(
            share[:, None, None] * np.diag(lines.mean_squares).astype(complex), self.period
        )
