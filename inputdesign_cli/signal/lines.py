"""The sinusoids that stand for a spectrum: frequencies and Hermitian power matrices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.spectrum import Basis, TabulatedSpectrum

_END = 1e-12


@dataclass(frozen=True)
class Lines:
    """Sinusoids at `frequencies` (L,) in rad per step with power matrices (L, r, r), Hermitian.

    `period`, in steps, is given if all lines are its harmonics; it is None for lines anywhere.
    """

    frequencies: Array
    powers: ComplexArray
    period: int | None = None

    def scaled(self, factor: float) -> Lines:
        """Return the lines with all powers multiplied by `factor`."""
        return Lines(self.frequencies, factor * self.powers, self.period)

    @property
    def inputs(self) -> int:
        """Return the number of signals that share the lines."""
        return int(self.powers.shape[1])

    @property
    def mean_squares(self) -> Array:
        """Return the powers of the inputs (r,)."""
        return np.asarray(np.einsum("naa->a", self.powers).real)

    @property
    def totals(self) -> Array:
        """Return the power of each line in all inputs together, (L,)."""
        return np.asarray(np.einsum("naa->n", self.powers).real)

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Return the lines at 0 and pi, where a sinusoid has no phase, only a sign, (L,)."""
        return (self.frequencies < _END) | (self.frequencies > np.pi - _END)

    @cached_property
    def roots(self) -> ComplexArray:
        """Return Hermitian square roots of the powers, real ones at 0 and pi, (L, r, r)."""
        powers = np.where(self.real[:, None, None], self.powers.real, self.powers)
        if self.inputs == 1:
            return np.asarray(np.sqrt(np.maximum(powers.real, 0.0)), dtype=complex)
        values, vectors = np.linalg.eigh(powers)
        half = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        return np.asarray(half @ vectors.conj().swapaxes(1, 2))

    def dense(self, period: int) -> ComplexArray:
        """Return the powers, each at the nearest harmonic of the period, (period // 2 + 1, r, r)."""
        powers = np.zeros((period // 2 + 1, self.inputs, self.inputs), dtype=complex)
        nearest = np.rint(self.frequencies * period / (2.0 * np.pi)).astype(int)
        np.add.at(powers, np.minimum(nearest, period // 2), self.powers)
        return powers

    @classmethod
    def of_period(cls, powers: ComplexArray, period: int) -> Lines:
        """Return the harmonics of a period that carry power, from all matrices (period // 2 + 1, r, r)."""
        kept = np.trace(powers, axis1=1, axis2=2).real > 0
        return cls(2.0 * np.pi * np.flatnonzero(kept) / period, powers[kept], period)


def orthogonal_columns(order: int) -> NDArray:
    """Return orthogonal columns (order, order) of modulus one: Hadamard where there is one, or Fourier."""
    if order & (order - 1) == 0:
        return scipy.linalg.hadamard(order).astype(float)
    return np.exp(2j * np.pi * np.outer(np.arange(order), np.arange(order)) / order)


def block_vectors(lines: Lines, block: int) -> ComplexArray:
    """Return root(P) q_b, the line vectors of a period of an orthogonal record without the phase, (L, r)."""
    return np.asarray(lines.roots @ orthogonal_columns(lines.inputs)[:, block].astype(complex))


def merged(lines: Lines, samples: int) -> Lines:
    """Merge lines that a record of this number of samples cannot resolve, and add up their powers.

    The exchange finds the same optimal frequency several times over, to within rounding; in a record these
    lines would beat. Lines that it cannot distinguish from 0 or pi become constant or alternating. Over the
    record they have no phase, and with a random one might vanish.
    """
    order = np.argsort(lines.frequencies)
    w, powers, total = lines.frequencies[order], lines.powers[order], lines.totals[order]
    groups: list[list[int]] = []
    for index in range(w.size):
        if groups and w[index] - w[groups[-1][0]] < np.pi / samples:
            groups[-1].append(index)
        else:
            groups.append([index])
    middle = np.array([np.average(w[group], weights=total[group]) for group in groups])
    middle = np.where(
        middle < np.pi / samples, 0.0, np.where(middle > np.pi - np.pi / samples, np.pi, middle)
    )
    return Lines(middle, np.array([powers[group].sum(axis=0) for group in groups]), lines.period)


def grid_lines(density: NDArray, period: int, step: float) -> Lines:
    """Return the lines of a period that stand for a spectrum.

    They sample the circle evenly, so that the powers add up to that of the spectrum whenever its order is
    below the period.

    Args:
        density: Phi, (n, r, r) or (n,), at the frequencies 2 pi l / (period step), l = 0 .. period // 2.
        step: time between samples in the unit of time of the spectrum (1 for rad/sample).
    """
    phi = density[:, None, None] if density.ndim == 1 else density
    power = phi.astype(complex) * (2.0 / (period * step))
    power[0] *= 0.5
    if period % 2 == 0:
        power[-1] *= 0.5
    return Lines.of_period(np.asarray(power, dtype=complex), period)


@dataclass(frozen=True)
class DesignedSpectrum:
    """A density over frequency or sinusoids, for records of values `step` apart; it can be pickled.

    Args:
        inputs: the number r of inputs.
        power: the mean square, of all inputs together.
        step: time between samples in the unit of time of the frequencies (1 for rad/sample).
        density: maps frequencies (n,) to Phi, (n,) for one input, else (n, r, r); None for sinusoids.
        sinusoids: the sinusoids of a spectrum without a density, frequencies in its own unit.
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
        """Return the spectrum with coefficients `x` on `basis`."""
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
    """Return a density (r, r) at frequencies (n,): (n,) for one input, else (n, r, r)."""
    return np.full(w.shape, density[0, 0]) if density.size == 1 else np.ones(w.shape)[:, None, None] * density
