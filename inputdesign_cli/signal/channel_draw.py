"""One draw of a record of several inputs: values of the recipe's kind with the designed matrix spectrum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channel_levels import few_levels
from inputdesign_cli.signal.channels import (
    ChannelPhases,
    Lines,
    blocks_of,
    gaussian_record,
    multisine_record,
)
from inputdesign_cli.signal.levels import pseudo_random, register_length
from inputdesign_cli.signal.settings import SignalSettings
from inputdesign_cli.signal.sinusoids import select

Angles = Callable[[Lines, int, np.random.Generator], Array | None]


def uniform(lines: Lines, values: int, rng: np.random.Generator) -> Array | None:
    """Phases are drawn uniformly: no angles are set."""
    return None


@dataclass(frozen=True)
class ChannelSignalGenerator:
    """Draws records of `samples` samples.

    Args:
        design: the lines that stand for the design, from the values a period and the samples for which
            each value is held; frequencies in rad per value.
        band: where white excitation has its power, in rad per sample.
        phases: of a multisine over the inputs.
        angles: the common phases (L,) of lines whose record has so many values; None: uniform.
    """

    design: Callable[[int, int], Lines]
    recipe: SignalSettings
    samples: int
    band: tuple[float, float] = (0.0, np.pi)
    phases: ChannelPhases = "orthogonal"
    angles: Angles = uniform

    @property
    def period(self) -> int:
        """Values in one period of the record, all of its blocks."""
        return self.recipe.period(self.samples)

    @cached_property
    def lines(self) -> Lines:
        """Those of one block of values: a period of the multisine, as many as there are inputs.

        Lines of a design of sinusoids keep their own frequencies in a multisine of single samples that is
        not repeated; otherwise they move to the nearest harmonics.
        """
        recipe = self.recipe
        blocks = 1
        if recipe.method in ("multisine", "binary", "ternary"):
            blocks = blocks_of(self.phases, self.design(self.period, recipe.hold).inputs)
        block = self.period // blocks
        lines = self.design(block, recipe.hold)
        if recipe.method == "multisine" and recipe.block == 1 and recipe.lines is None:
            return lines
        powers = select(lines.dense(block), recipe.lines)
        if recipe.hold > 1:
            powers = powers / self._hold_gain(block)[:, None, None]
        return Lines.of_period(powers, block)

    def _hold_gain(self, block: int) -> Array:
        """(block // 2 + 1,): what holding each value does to the powers of the harmonics."""
        w = 2.0 * np.pi * np.arange(block // 2 + 1) / (block * self.recipe.hold)
        return np.abs(np.exp(-1j * np.outer(w, np.arange(self.recipe.hold))).mean(axis=1)) ** 2

    def values(self, rng: np.random.Generator) -> Array:
        """(samples // hold, r): one record, faded in and out, before each value is held."""
        recipe = self.recipe
        one = np.tile(self._period(rng), (recipe.periods, 1))
        return one * recipe.taper(len(one))[:, None]

    def _period(self, rng: np.random.Generator) -> Array:
        method, lines, length = self.recipe.method, self.lines, self.period
        if method == "multisine":
            angles = self.angles(lines, length, rng)
            return multisine_record(lines, length, rng, self.phases, angles=angles)
        if method in ("binary", "ternary"):
            return few_levels(lines, length, rng, method)
        if method == "filtered_noise":
            return gaussian_record(lines, rng)
        if method == "white":
            return gaussian_record(self._white(lines), rng)
        if method == "prbs":
            return self._shifted(rng) * np.sqrt(lines.mean_squares)
        raise ValueError("a given record is not drawn")

    def _white(self, lines: Lines) -> Lines:
        """Flat over the band, each input with its designed power, not correlated."""
        harmonics = np.arange(self.period // 2 + 1)
        w = 2.0 * np.pi * harmonics / (self.period * self.recipe.hold)
        inside = (w >= self.band[0] * (1 - 1e-9)) & (w <= self.band[1] * (1 + 1e-9))
        ends = (harmonics == 0) | (2 * harmonics == self.period)
        share = np.where(inside, np.where(ends, 0.5, 1.0), 0.0)
        share = share / max(float(share.sum()), 1e-300)
        return Lines.of_period(
            share[:, None, None] * np.diag(lines.mean_squares).astype(complex), self.period
        )

    def _shifted(self, rng: np.random.Generator) -> Array:
        """(period, r): one maximum length sequence, for each input shifted by an equal part of its length.

        Over a whole sequence the inputs are correlated by -1 over its length, but for lags at the shifts.
        """
        r = self.lines.inputs
        bits = self.recipe.bits or register_length(self.period)
        shift = min((2**bits - 1) // r, self.period)
        sequence = pseudo_random(bits, (r - 1) * shift + self.period, rng)
        return np.stack([sequence[a * shift : a * shift + self.period] for a in range(r)], axis=1)
