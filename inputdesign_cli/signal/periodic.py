"""Periodic records of a spectrum that is known harmonic by harmonic; Gaussian noise for many runs at once."""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.signal.lines import Lines


def harmonics(samples: int) -> Array:
    """Return the frequencies that fit into a record, in rad/sample, (samples // 2 + 1,)."""
    return 2 * np.pi * np.arange(samples // 2 + 1) / samples


def periodogram(signal: Array) -> Lines:
    """Return all lines of a record (samples, r), each of rank one."""
    samples = len(signal)
    columns = np.fft.rfft(signal, axis=0) / samples
    powers = 2.0 * columns[:, :, None] * np.conj(columns[:, None, :])
    powers[_ends(samples)] *= 0.5
    return Lines(harmonics(samples), np.asarray(powers), samples)


def dense_roots(lines: Lines, samples: int) -> ComplexArray:
    """Return Hermitian roots (samples // 2 + 1, r, r) of the powers at all harmonics, zero without a line."""
    return Lines(harmonics(samples), lines.dense(samples), samples).roots


def even_multisine(lines: Lines, samples: int, rng: np.random.Generator, *, periods: int) -> Array:
    """Return blocks of samples / periods, each line of a block of rank one, with random phases, (samples, r).

    With as many periods as inputs the vectors of the blocks are orthogonal, and the blocks together have the
    spectrum exactly. In contrast to `multisine_record` every column of the roots has phases of its own. No
    block takes more than its share of the power, which keeps the peak low where inputs are alike.
    """
    length, r = samples // periods, lines.inputs
    roots = dense_roots(lines, length)
    phase, ends = np.exp(2j * np.pi * rng.random((len(roots), r))), _ends(length)
    phase[ends] = np.where(rng.random((len(ends), r)) < 0.5, -1.0, 1.0)
    amplitude = np.full(len(roots), length / np.sqrt(2.0))
    amplitude[ends] = length
    vectors = roots * (phase * amplitude[:, None])[:, None]
    turns = np.ones((periods, r))
    if periods == r:
        turns = np.sqrt(r) * scipy.fft.dct(np.eye(r), axis=0, norm="ortho")
    return np.concatenate([np.fft.irfft(vectors @ turn, length, axis=0) for turn in turns])


def noise_drive(inputs: int, samples: int, runs: int, rng: np.random.Generator) -> ComplexArray:
    """Draw white Gaussian noise of period `samples` over its harmonics, (runs, samples // 2 + 1, inputs)."""
    # Channels come first in memory, so that each is one contiguous block.
    drive = rng.standard_normal((inputs, runs, 2 * (samples // 2 + 1))).view(np.complex128)
    # E|u_hat / samples|^2 is half the power at inner lines, and all of it at the ends, which are real.
    drive *= 0.5 * samples
    for end in _ends(samples):
        drive[..., end] = 2 * drive[..., end].real
    return np.moveaxis(drive, 0, -1)


def shaped_noise(roots: ComplexArray, drive: ComplexArray, samples: int) -> Array:
    """Return the drive with the spectrum of `roots`, see `dense_roots`, (runs, samples, r)."""
    inputs = drive.shape[-1]
    out = np.empty((inputs, len(drive), samples))
    for i in range(inputs):
        mixed = roots[:, i, 0] * drive[..., 0]
        for j in range(1, inputs):
            mixed += roots[:, i, j] * drive[..., j]
        out[i] = np.fft.irfft(mixed, samples)
    return np.moveaxis(out, 0, -1)


def _ends(samples: int) -> list[int]:
    """Return the harmonics at 0 and pi, where spectra are real and lines count once."""
    return [0] if samples % 2 else [0, -1]
