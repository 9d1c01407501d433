"""One draw of a record's shape: the values of the recipe's kind of signal with the designed spectrum."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.channels import Lines, is_real, merged
from inputdesign_cli.signal.crest import optimise_phases
from inputdesign_cli.signal.generate import filtered_noise, line_powers
from inputdesign_cli.signal.levels import pseudo_random, register_length, three_level, two_level
from inputdesign_cli.signal.settings import Method, SignalSettings
from inputdesign_cli.signal.sinusoids import Sinusoids, select
from inputdesign_cli.signal.spectral_factor import SpectralFactor, spectral_factor
from inputdesign_cli.spectrum import FirBasis, LinesBasis

# Beyond this relative error of its autocovariances a factor no longer has the designed spectrum.
_FACTOR_RESIDUAL = 1e-8


@dataclass(frozen=True)
class SignalGenerator:
    """Draws records of `samples` samples of the spectrum with coefficients `x` on `basis`."""

    basis: FirBasis | LinesBasis
    x: Array
    recipe: SignalSettings
    samples: int

    @property
    def total(self) -> float:
        """The power of the design."""
        return float(self.x[0]) if isinstance(self.basis, FirBasis) else float(np.sum(self.x))

    @cached_property
    def factor(self) -> SpectralFactor | None:
        """For filtered noise."""
        if isinstance(self.basis, FirBasis) and self.recipe.method == "filtered_noise":
            return spectral_factor(self.x)
        return None

    @property
    def method(self) -> Method:
        """What is made: a multisine where noise was asked for, but no spectral factor can be had to 1e-8."""
        if self.recipe.method != "filtered_noise":
            return self.recipe.method
        usable = self.factor is not None and self.factor.residual <= _FACTOR_RESIDUAL
        return "filtered_noise" if usable else "multisine"

    @cached_property
    def lines(self) -> Sinusoids:
        """The sinusoids of one period that stand for the spectrum.

        Those of a line spectrum keep their own frequencies when the record is one period of
        single samples; otherwise they move to the nearest harmonics.
        """
        period = self.recipe.period(self.samples)
        free = self.recipe.block == 1 and self.recipe.lines is None and self.method == "multisine"
        if isinstance(self.basis, LinesBasis) and free:
            return Sinusoids(*_apart(self.basis, self.x, period), period)
        return Sinusoids.on_grid(select(self._grid_powers(period), self.recipe.lines), period)

    def values(self, rng: np.random.Generator, gains: tuple[ComplexArray, ...] = ()) -> Array:
        """(samples // hold,): one record, faded in and out, before each value is held.

        Args:
            gains: what optimised phases keep low besides the record, see `optimise_phases`.
        """
        recipe = self.recipe
        length = self.samples // recipe.hold
        if recipe.method == "given":
            raise ValueError("a given record is not drawn")
        if self.method == "filtered_noise" and self.factor is not None and recipe.periods == 1:
            noise = filtered_noise(self.factor.taps, self.samples, rng)
            return noise[:: recipe.hold] * recipe.taper(length)
        if self.method == "filtered_noise":
            one = self._gaussian(rng)
        elif self.method == "white":
            one = rng.standard_normal(recipe.period(self.samples))
        elif self.method == "prbs":
            period = recipe.period(self.samples)
            one = pseudo_random(recipe.bits or register_length(period), period, rng)
        elif self.method == "multisine":
            one = self.lines.record(self._phases(rng, gains))
        else:
            one = (two_level if self.method == "binary" else three_level)(self.lines, rng)
        return np.tile(one, recipe.periods) * recipe.taper(length)

    def _phases(self, rng: np.random.Generator, gains: tuple[ComplexArray, ...]) -> Array:
        if self.recipe.phases == "schroeder":
            return self.lines.schroeder_phases()
        start = self.lines.random_phases(rng)
        return optimise_phases(self.lines, start, gains=gains) if self.recipe.phases == "optimised" else start

    def _gaussian(self, rng: np.random.Generator) -> Array:
        """One period of Gaussian noise: random amplitudes at all of its lines, not only random phases."""
        period = self.recipe.period(self.samples)
        lines = Sinusoids.on_grid(self._grid_powers(period), period)
        random = rng.standard_normal((2, lines.powers.size))
        weight = np.where(lines.real, random[0] ** 2, 0.5 * np.sum(random**2, axis=0))
        scaled = Sinusoids(lines.frequencies, lines.powers * weight, period, lines.harmonics)
        return scaled.record(lines.random_phases(rng))

    def _grid_powers(self, period: int) -> Array:
        """(period // 2 + 1,): powers of the harmonics of a period of values, the hold allowed for.

        Holding each value k times multiplies the spectrum by |sum_{i<k} e^{-jwi} / k|^2, which is undone
        here; what that leaves above pi / k is lost.
        """
        hold = self.recipe.hold
        harmonics = np.arange(period // 2 + 1)
        if isinstance(self.basis, FirBasis):
            w = 2.0 * np.pi * harmonics / (period * hold)
            power = line_powers(self.basis.density(self.x, w), period) / hold
        else:
            power = np.zeros(harmonics.size)
            nearest = np.rint(self.basis.frequencies * hold * period / (2.0 * np.pi)).astype(int)
            np.add.at(power, np.minimum(nearest, period // 2), self.x)
            w = 2.0 * np.pi * harmonics / (period * hold)
        if hold == 1:
            return power
        kernel = np.abs(np.exp(-1j * np.outer(w, np.arange(hold))).mean(axis=1)) ** 2
        return power / kernel


def _apart(basis: LinesBasis, x: Array, samples: int) -> tuple[Array, Array]:
    """Frequencies and powers of the sinusoids to be made; those given by the user are left as they are.

    Free lines next to 0 or pi become constant or alternating: over the record they have no phase, and with a
    random one might vanish.
    """
    carrying = x > 0
    if not basis.free:
        return basis.frequencies[carrying], x[carrying]
    lines = merged(Lines(basis.frequencies[carrying], x[carrying, None, None].astype(complex)), samples)
    w = lines.frequencies
    ends = np.where(w < 0.5 * np.pi, 0.0, np.pi)
    return np.where(is_real(w, samples), ends, w), lines.powers[:, 0, 0].real
