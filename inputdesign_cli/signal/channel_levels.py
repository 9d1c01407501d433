"""Signals of two or three levels at several inputs, with a wanted matrix spectrum.

One period a block, as many blocks as inputs. The transforms of the blocks at a line are the columns of a
matrix Z (r x r); the record has the power matrix P there when Z Z^* is proportional to P. The matrix of
that kind nearest to Z is P^(1/2) times the unitary factor of P^(1/2) Z (the orthogonal Procrustes problem:
G. H. Golub and C. F. Van Loan, Matrix Computations, Section 6.4.1). With one input that keeps the phase of
the line and restores its modulus, as in `levels`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.channel_crest import low_peak_angles
from inputdesign_cli.signal.channels import Lines, multisine_record, roots_of
from inputdesign_cli.signal.levels import EVEN, EVEN_STEPS, alternate, signs, signs_and_zeros


def few_levels(
    lines: Lines, samples: int, rng: np.random.Generator, kind: Literal["binary", "ternary"]
) -> Array:
    """(samples, r): `lines.inputs` blocks of a period each, every input of two or three levels of its own.

    The powers of the inputs are those of the lines. What remains beyond the last period continues it.
    """
    assert lines.period is not None
    period, r = lines.period, lines.inputs
    rms = np.sqrt(lines.mean_squares)
    roots = np.zeros((period // 2 + 1, r, r), dtype=complex)
    roots[np.rint(lines.frequencies * period / (2.0 * np.pi)).astype(int)] = roots_of(lines, period)
    angles = low_peak_angles(
        lines, r * period, 2.0 * np.pi * rng.random(len(lines.powers)), powers=EVEN, steps=EVEN_STEPS
    )
    start = multisine_record(lines, r * period, rng, "orthogonal", angles=angles)

    def restored(levels: Array) -> tuple[Array, float]:
        transform = np.fft.rfft(levels.reshape(r, period, r), axis=1).transpose(1, 2, 0)
        wanted = _restored(roots, transform, period)
        fit = float(np.vdot(transform, wanted).real / np.vdot(transform, transform).real)
        blocks = np.fft.irfft(wanted.transpose(2, 0, 1), period, axis=1)
        return blocks.reshape(r * period, r), float(np.sum(np.abs(wanted - fit * transform) ** 2))

    nearest = {"binary": signs, "ternary": signs_and_zeros}[kind]
    record = alternate(start, lambda values: _each(values, nearest, rms), restored)
    edges = np.linspace(0, samples, r + 1).astype(int)
    lengths = np.diff(edges)
    return np.concatenate(
        [record[b * period + np.arange(length) % period] for b, length in enumerate(lengths)]
    )


def _restored(roots: ComplexArray, transform: ComplexArray, period: int) -> ComplexArray:
    """(L, r, r): the matrices of the wanted powers nearest to those of the blocks (columns)."""
    left, _, right = np.linalg.svd(roots @ transform)
    line = np.full(len(roots), np.sqrt(0.5))
    line[0] = 1.0
    if period % 2 == 0:
        line[-1] = 1.0
    # Columns of the orthogonal multisine: vectors root(P) q_b, q of modulus sqrt(r) in all.
    size = line * period * np.sqrt(roots.shape[1])
    return np.asarray(size[:, None, None] * (roots @ left @ right))


def _each(values: Array, nearest: Callable[[Array], Array], rms: Array) -> Array:
    """Input by input the nearest levels, of the wanted root mean square."""
    columns = []
    for column, size in zip(values.T, rms, strict=True):
        levels = nearest(column) if size > 0.0 else np.zeros_like(column)
        now = float(np.sqrt(np.mean(levels**2)))
        columns.append(levels * (size / now) if now > 0.0 else levels)
    return np.stack(columns, axis=1)
