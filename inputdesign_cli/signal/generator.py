"""Records with a designed spectrum, of the kind that the settings ask for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.kind import Draft, LimitedResponses, SignalKind
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.lines import DesignedSpectrum, Lines
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.signal.sinusoids import select
from inputdesign_cli.signal.spectral_factor import SpectralFactor, spectral_factor

# Beyond this relative error of its autocovariances a factor no longer has the designed spectrum.
_FACTOR_RESIDUAL = 1e-8


@dataclass(frozen=True)
class SignalGenerator:
    """Makes records of `samples` samples, each from random numbers of its own; it can be pickled.

    Args:
        band: the band of white excitation, in rad per sample.
        limited: signals that optimised phases keep low, at frequencies in rad per value; None: the inputs.
    """

    spectrum: DesignedSpectrum
    settings: SignalSettings
    samples: int
    band: tuple[float, float] = (0.0, np.pi)
    limited: LimitedResponses | None = None

    @cached_property
    def factor(self) -> SpectralFactor | None:
        """Return the spectral factor for filtered noise of one input that a moving average can make."""
        if self.settings.method != "filtered_noise" or self.spectrum.autocovariances is None:
            return None
        return spectral_factor(self.spectrum.autocovariances)

    @cached_property
    def method(self) -> str:
        """Return the name of the kind that is made.

        In place of noise it is a multisine if the spectrum consists of sinusoids, or if no spectral factor is
        accurate to 1e-8 (a spectrum with deep zeros).
        """
        if self.settings.method != "filtered_noise":
            return self.settings.method
        unusable = self.factor is not None and self.factor.residual > _FACTOR_RESIDUAL
        return "multisine" if unusable or self.spectrum.sinusoids is not None else "filtered_noise"

    @cached_property
    def kind(self) -> SignalKind:
        """Return the kind of this name."""
        return kind_of(self.method)

    @property
    def period(self) -> int:
        """Return the values in one period of the record, all of its blocks."""
        return self.settings.period(self.samples)

    @cached_property
    def lines(self) -> Lines:
        """Return the lines of one block of values; a period of the signal consists of one or more blocks.

        Lines of a design of sinusoids keep their own frequencies in a multisine of single samples that is not
        repeated. Otherwise they move to the nearest harmonics.
        """
        settings, kind = self.settings, self.kind
        block = self.period // kind.blocks(settings, self.spectrum.inputs)
        lines = self.spectrum.lines(block, settings.hold)
        if kind.off_grid and settings.block == 1 and settings.lines is None:
            return lines
        powers = select(lines.dense(block), settings.lines)
        if settings.hold > 1:
            powers = powers / self._hold_gain(block)[:, None, None]
        return Lines.of_period(powers, block)

    def values(self, rng: np.random.Generator) -> Array:
        """Return one record, faded in and out, before each value is held, (samples // hold, r)."""
        return self.several([rng])[0]

    def several(self, rngs: Sequence[np.random.Generator]) -> Array:
        """Return a record from each of the generators, as `values` does, (runs, samples // hold, r)."""
        settings = self.settings
        if self.factor is not None and self.method == "filtered_noise" and settings.periods == 1:
            noise = np.stack([self.factor.filtered(self.samples, rng) for rng in rngs])
            whole = noise[:, :: settings.hold, None]
        else:
            draft = self._draft
            drawn = np.stack([self.kind.draw(draft, rng) for rng in rngs])
            whole = np.tile(drawn, (1, settings.periods, 1))
        if settings.ramp:
            whole = whole * settings.taper(whole.shape[1])[:, None]
        if settings.returns:
            whole[:, -1] = 0.0
        return whole

    @property
    def _draft(self) -> Draft:
        """Return the settings from which one period is drawn; band and lines are in rad per value."""
        lo, hi = (min(edge * self.settings.hold, np.pi) for edge in self.band)
        return Draft(self.lines, self.period, self.settings, (lo, hi), self.limited)

    def _hold_gain(self, block: int) -> Array:
        """Return the gain of holding each value k times on the powers of the harmonics, (block // 2 + 1,).

        It is |sum_{i<k} e^{-jwi} / k|^2. `lines` compensates it up to pi / k; the powers above are lost.
        """
        w = 2.0 * np.pi * np.arange(block // 2 + 1) / (block * self.settings.hold)
        return np.abs(np.exp(-1j * np.outer(w, np.arange(self.settings.hold))).mean(axis=1)) ** 2
