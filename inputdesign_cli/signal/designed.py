"""The spectrum that records are made of, whatever family it was designed in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.lines import Lines, grid_lines, merged
from inputdesign_cli.spectrum import Basis, TabulatedSpectrum


@dataclass(frozen=True)
class DesignedSpectrum:
    """A density over frequency or sinusoids, for records of values `step` apart; other processes can have it.

    Args:
        inputs: r.
        power: the mean square, of all inputs together.
        step: time between samples in the unit of time of the frequencies (1 for rad/sample).
        density: maps frequencies (n,) to Phi, (n,) for one input, else (n, r, r); None for sinusoids.
        sinusoids: of a spectrum without a density, frequencies in its own unit.
        free: whether their frequencies were found, not given.
        autocovariances: (m + 1,) c_0 .. c_m of one input that a moving average can make.
    """

    inputs: int
    power: float
    step: float = 1.0
    density: Callable[[Array], NDArray] | None = None
    sinusoids: Lines | None = None
    free: bool = False
    autocovariances: Array | None = None

    @classmethod
    def of(
        cls, basis: Basis | TabulatedSpectrum, x: Array, *, inputs: int = 1, step: float = 1.0
    ) -> DesignedSpectrum:
        """The spectrum with coefficients `x` on `basis`."""
        every = partial(constant_density, np.eye(inputs))
        power = float(x @ basis.integrals(every, np.zeros(0, dtype=complex)))
        if not basis.has_density:
            return cls(inputs, power, step, sinusoids=Lines(*basis.lines(x)), free=basis.free)
        moving_average = basis.moving_average(x)
        return cls(inputs, power, step, partial(basis.density, x), autocovariances=moving_average)

    def lines(self, period: int, hold: int = 1) -> Lines:
        """Return the sinusoids of `period` values, each held for `hold` samples, in rad per value.

        A spectrum of sinusoids keeps its own frequencies. Free ones that the period cannot resolve become
        one; given ones stay unchanged.
        """
        step = hold * self.step
        if self.density is not None:
            w = np.asarray(2.0 * np.pi * np.arange(period // 2 + 1) / (period * step), dtype=np.float64)
            return grid_lines(self.density(w), period, step)
        if self.sinusoids is None:
            raise ValueError("a spectrum has a density or sinusoids")
        lines = Lines(self.sinusoids.frequencies * step, self.sinusoids.powers)
        return merged(lines, period) if self.free else lines


def constant_density(density: Array, w: Array) -> NDArray[np.float64]:
    """A density (r, r) at frequencies (n,): (n,) for one input, else (n, r, r)."""
    return np.full(w.shape, density[0, 0]) if density.size == 1 else np.ones(w.shape)[:, None, None] * density
