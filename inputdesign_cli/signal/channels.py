"""Multisines of several inputs with any Hermitian spectrum: a root of its power matrix for every line.

Over one period a line is one complex vector, so that its spectrum has rank one whatever was designed.
A record of r periods whose vectors are orthogonal has, on average over them, the full matrix.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array, ComplexArray

ChannelPhases = Literal["orthogonal", "random"]


@dataclass(frozen=True)
class Lines:
    """Sinusoids at `frequencies` (L,) in rad per step with power matrices (L, r, r), Hermitian.

    `period` in steps when all lines lie on its grid; None for lines anywhere.
    """

    frequencies: Array
    powers: ComplexArray
    period: int | None = None

    def scaled(self, factor: float) -> Lines:
        """The same with all powers multiplied."""
        return Lines(self.frequencies, factor * self.powers, self.period)

    @property
    def inputs(self) -> int:
        """How many signals share the lines."""
        return int(self.powers.shape[1])

    @property
    def mean_squares(self) -> Array:
        """(r,): the powers of the inputs."""
        return np.asarray(np.einsum("naa->a", self.powers).real)

    def dense(self, period: int) -> ComplexArray:
        """(period // 2 + 1, r, r): the powers, each at the harmonic of the period that is next to it."""
        powers = np.zeros((period // 2 + 1, self.inputs, self.inputs), dtype=complex)
        nearest = np.rint(self.frequencies * period / (2.0 * np.pi)).astype(int)
        np.add.at(powers, np.minimum(nearest, period // 2), self.powers)
        return powers

    @classmethod
    def of_period(cls, powers: ComplexArray, period: int) -> Lines:
        """The harmonics of a period that carry power, from the matrices (period // 2 + 1, r, r) of all."""
        kept = np.trace(powers, axis1=1, axis2=2).real > 0
        return cls(2.0 * np.pi * np.flatnonzero(kept) / period, powers[kept], period)


def merged(lines: Lines, samples: int) -> Lines:
    """Lines that a record of so many samples cannot tell apart as one each, with the sum of their powers.

    The exchange finds the same optimal frequency several times over, to within rounding; in a record such
    lines would beat, and near w = 0 cancel.
    """
    order = np.argsort(lines.frequencies)
    w, powers = lines.frequencies[order], lines.powers[order]
    total = np.trace(powers, axis1=1, axis2=2).real
    groups: list[list[int]] = []
    for index in range(w.size):
        if groups and w[index] - w[groups[-1][0]] < np.pi / samples:
            groups[-1].append(index)
        else:
            groups.append([index])
    middle = np.array([np.average(w[group], weights=total[group]) for group in groups])
    return Lines(middle, np.array([powers[group].sum(axis=0) for group in groups]), lines.period)


def orthogonal_columns(order: int) -> NDArray:
    """(order, order), entries of modulus one, orthogonal columns: Hadamard where there is one, or Fourier."""
    if order & (order - 1) == 0:
        return scipy.linalg.hadamard(order).astype(float)
    return np.exp(2j * np.pi * np.outer(np.arange(order), np.arange(order)) / order)


def blocks_of(phases: ChannelPhases, inputs: int) -> int:
    """How many periods with phases of their own a record has."""
    return inputs if phases == "orthogonal" else 1


def grid_lines(density: NDArray, period: int, step: float) -> Lines:
    """The lines of a period that stand for a spectrum.

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


def multisine_record(
    lines: Lines,
    samples: int,
    rng: np.random.Generator,
    phases: ChannelPhases,
    *,
    angles: Array | None = None,
) -> Array:
    """(samples, r): one block after the other, each with the same random phase a line.

    `orthogonal`: r blocks, line vectors root(P) e^{j psi} q_b with q_b the columns of an orthogonal
    matrix. `random`: one block, root(P) times independent uniform phases, Appendix B of the spectral
    design paper with its misprints mended (uniform phases, sqrt(N), H_im); P is met on average only.
    `angles` (L,) are the phases psi, drawn uniformly when not given.
    """
    number, r = lines.powers.shape[:2]
    columns = orthogonal_columns(r)
    common = rng.random(number)
    edges = np.linspace(0, samples, blocks_of(phases, r) + 1).astype(int)
    # At w = 0 and pi a sinusoid has no phase, only a sign, and its vector is real.
    real = is_real(lines.frequencies, edges[1])
    turn = np.where(real, np.where(common < 0.5, 1.0, -1.0), np.exp(2j * np.pi * common))
    if angles is not None:
        turn = np.where(real, np.where(np.cos(angles) >= 0, 1.0, -1.0), np.exp(1j * angles))
    roots = roots_of(lines, int(edges[1]))
    out = np.empty((samples, r))
    for block in range(edges.size - 1):
        if phases == "random":
            mix = np.exp(2j * np.pi * rng.random((number, r)))
        else:
            mix = np.broadcast_to(columns[:, block], (number, r)).astype(complex)
        signs = np.where(rng.random((number, r)) < 0.5, 1.0, -1.0)
        mix = np.where(real[:, None] & np.any(np.abs(mix.imag) > 1e-12, axis=1)[:, None], signs, mix)
        vectors = np.einsum("nab,nb->na", roots, mix) * turn[:, None]
        amplitude = np.where(real, 1.0, np.sqrt(2.0))[:, None] * vectors
        out[edges[block] : edges[block + 1]] = _sinusoids(lines, amplitude, edges[block + 1] - edges[block])
    return out


def gaussian_record(lines: Lines, rng: np.random.Generator) -> Array:
    """(period, r): Gaussian noise that is periodic, with random amplitudes at all of its harmonics."""
    assert lines.period is not None
    random = rng.standard_normal((2, len(lines.powers), lines.inputs))
    real = is_real(lines.frequencies, lines.period)[:, None]
    mix = np.where(real, random[0], (random[0] + 1j * random[1]) / np.sqrt(2.0))
    vectors = np.einsum("nab,nb->na", roots_of(lines, lines.period), mix)
    return _sinusoids(lines, np.where(real, 1.0, np.sqrt(2.0)) * vectors, lines.period)


def in_phase_record(frequencies: Array, amplitudes: Array, samples: int, rng: np.random.Generator) -> Array:
    """(samples, r): sinusoids of these amplitudes (L, r), each of one random phase in all channels.

    At 0 and pi a sinusoid is a constant or alternates; its sign is random.
    """
    phases = 2.0 * np.pi * rng.random(frequencies.size)
    real = (frequencies <= 0.0) | (frequencies >= np.pi)
    phases[real] = np.where(phases[real] < np.pi, 0.0, np.pi)
    return np.cos(np.outer(np.arange(samples), frequencies) + phases) @ amplitudes


def block_vectors(lines: Lines, samples: int, block: int) -> ComplexArray:
    """(L, r): root(P) q_b, the line vectors of a period of an orthogonal record but for the common phase."""
    r = lines.inputs
    return np.asarray(roots_of(lines, samples // r) @ orthogonal_columns(r)[:, block].astype(complex))


def roots_of(lines: Lines, samples: int) -> ComplexArray:
    """(L, r, r): Hermitian square roots of the powers, real ones at 0 and pi."""
    real = is_real(lines.frequencies, samples)[:, None, None]
    return np.where(real, _roots(lines.powers.real.astype(complex)), _roots(lines.powers))


def is_real(w: Array, samples: int) -> NDArray[np.bool_]:
    """Lines that a record of so many samples cannot tell from 0 or pi."""
    return (w < np.pi / samples) | (w > np.pi - np.pi / samples)


def _sinusoids(lines: Lines, amplitude: ComplexArray, samples: int) -> Array:
    """sum over lines of Re(amplitude e^{jwt}), in each block from its own start."""
    if lines.period is None:
        time = np.arange(samples)
        return (np.exp(1j * np.outer(time, lines.frequencies)) @ amplitude).real
    spectrum = np.zeros((lines.period // 2 + 1, amplitude.shape[1]), dtype=complex)
    index = np.rint(lines.frequencies * lines.period / (2 * np.pi)).astype(int)
    ends = (index == 0) | (2 * index == lines.period)
    spectrum[index] = amplitude * np.where(ends, 1.0, 0.5)[:, None] * lines.period
    one = np.fft.irfft(spectrum, lines.period, axis=0)
    return one[np.arange(samples) % lines.period]


def _roots(powers: ComplexArray) -> ComplexArray:
    """Hermitian square roots (L, r, r) of positive semidefinite matrices."""
    values, vectors = np.linalg.eigh(powers)
    half = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    return half @ vectors.conj().swapaxes(1, 2)
