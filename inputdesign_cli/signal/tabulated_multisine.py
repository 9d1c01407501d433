"""Several inputs with a spectrum that is given frequency by frequency, made on the lines of the record.

A spectrum is held as masses (L, n, n), one Hermitian matrix for each line 2 pi l / samples,
l = 0 .. samples // 2: the real part of their sum is the covariance of the signal.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray


def lines_of(samples: int) -> Array:
    """(L,): the frequencies that fit into a record, in rad/sample."""
    return 2 * np.pi * np.arange(samples // 2 + 1) / samples


def masses_of_density(density: ComplexArray, samples: int) -> ComplexArray:
    """Masses of the lines from Phi (L, n, n) at them; the ends of the axis are real and count once."""
    masses = 2.0 * density / samples
    ends = [0] if samples % 2 else [0, -1]
    masses[ends] = 0.5 * masses[ends].real
    return masses


def masses_on_record(frequencies: Array, masses: ComplexArray, samples: int) -> ComplexArray:
    """Masses at any frequencies moved to the nearest line of the record."""
    nearest = np.round(frequencies * samples / (2 * np.pi)).astype(int)
    nearest = np.clip(nearest, 0, samples // 2)
    moved = np.zeros((samples // 2 + 1, *masses.shape[1:]), dtype=complex)
    np.add.at(moved, nearest, masses)
    ends = [0] if samples % 2 else [0, -1]
    moved[ends] = moved[ends].real
    return moved


def roots_of(masses: ComplexArray) -> ComplexArray:
    """The Hermitian roots of the masses."""
    values, vectors = np.linalg.eigh(masses)
    roots = (vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]) @ np.conj(np.swapaxes(vectors, 1, 2))
    return np.asarray(roots)


def noise_drive(n: int, samples: int, runs: int, rng: np.random.Generator) -> ComplexArray:
    """(n, runs, lines): white Gaussian noise of period `samples` in the frequency domain."""
    lines = samples // 2 + 1
    # E|u_hat / samples|^2 is mass / 2 at inner lines, and mass at the ends, which are real.
    drive = rng.standard_normal((n, runs, 2 * lines)).view(np.complex128)
    drive *= 0.5 * samples
    for end in (0,) if samples % 2 else (0, -1):
        drive[..., end] = 2 * drive[..., end].real
    return drive


def shaped_noise(roots: ComplexArray, drive: ComplexArray, samples: int) -> Array:
    """(n, runs, samples): the drive with the spectrum of `roots` (lines, n, n)."""
    out = np.empty((drive.shape[0], drive.shape[1], samples))
    for i in range(drive.shape[0]):
        mixed = roots[:, i, 0] * drive[0]
        for j in range(1, drive.shape[0]):
            mixed += roots[:, i, j] * drive[j]
        out[i] = np.fft.irfft(mixed, samples)
    return out


def periodic_noise(roots: ComplexArray, samples: int, runs: int, rng: np.random.Generator) -> Array:
    """(n, runs, samples): Gaussian noise of period `samples` with the spectrum of `roots`."""
    return shaped_noise(roots, noise_drive(roots.shape[1], samples, runs, rng), samples)


def matrix_multisine(
    density_masses: ComplexArray, samples: int, rng: np.random.Generator, *, periods: int
) -> Array:
    """(n, samples): `periods` blocks of samples / periods, random phases, each line of a block rank one.

    With as many periods as inputs the phases of the blocks are orthogonal, and the blocks together
    have the masses exactly; masses are those of the lines of one block.
    """
    length = samples // periods
    n = density_masses.shape[1]
    roots = roots_of(density_masses)
    lines = roots.shape[0]
    phase = np.exp(2j * np.pi * rng.random((lines, n)))
    ends = [0] if length % 2 else [0, lines - 1]
    phase[ends] = np.where(rng.random((len(ends), n)) < 0.5, -1.0, 1.0)
    amplitude = np.full(lines, length / np.sqrt(2.0))
    amplitude[ends] = length
    blocks = []
    for p in range(periods):
        turn = _orthogonal_row(p, periods, n)
        columns = np.einsum("lij,lj,j->il", roots, phase, turn)
        blocks.append(np.fft.irfft(columns * amplitude, length))
    return np.concatenate(blocks, axis=1)


def _orthogonal_row(period: int, periods: int, n: int) -> Array:
    """Row `period` of a real matrix (periods, n) with orthogonal columns of norm sqrt(periods)."""
    if periods != n:
        return np.ones(n)
    row = np.arange(n)
    cosine = np.cos(np.pi * (row + 0.5) * period / n) * np.sqrt(2.0 if period else 1.0)
    return np.asarray(cosine)


def periodogram_masses(signal: Array) -> ComplexArray:
    """Masses (L, n, n) of the lines of a record (n, samples), each of rank one."""
    samples = signal.shape[1]
    columns = np.fft.rfft(signal).T / samples
    masses = 2.0 * columns[:, :, None] * np.conj(columns[:, None, :])
    ends = [0] if samples % 2 else [0, -1]
    masses[ends] *= 0.5
    return np.asarray(masses)
