"""Signals of two or three levels with a wanted spectrum.

A two-level signal cannot have an arbitrary spectrum. These start from a multisine of the wanted line powers.
Its phases make its fourth power small, so that its modulus hardly varies and little is lost by taking
signs. Then they alternate between two projections: the nearest signal of these levels, and the nearest one
with these line powers. Discrete-interval binary signals of specified line powers are due to
[van-den-bos-krol-1979]. The loss against the designed spectrum is measured on the record's own information.

The record has one period a block, as many blocks as inputs. The transforms of the blocks at a line are the
columns of a matrix Z (r x r). The record has the power matrix P there when Z Z^* is proportional to P. The
matrix of that kind nearest to Z is P^(1/2) times the unitary factor of P^(1/2) Z (the orthogonal Procrustes
problem, [golub-van-loan], Section 6.4.1). With one input that keeps the phase of the line and restores its
modulus.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.signal.kind import Draft, SignalKind
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.phases import low_peak_phases
from inputdesign_cli.signal.settings import SignalSettings

# The 4-norm alone makes the modulus most even.
_EVEN, _EVEN_STEPS = (4,), 60
_ROUNDS = 60


@dataclass(frozen=True)
class FewLevels(SignalKind):
    """Two or three levels with a spectrum near the wanted one; `nearest` takes values (n,) to levels."""

    nearest: Callable[[Array], Array]
    few_levels: bool = False
    slewed: bool = False
    switched: bool = False

    def blocks(self, settings: SignalSettings, inputs: int) -> int:
        """See `SignalKind`."""
        return inputs

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`; ramps between the levels come with the limits."""
        return few_levels(draft.lines, draft.samples, rng, self.nearest)


def few_levels(
    lines: Lines, samples: int, rng: np.random.Generator, nearest: Callable[[Array], Array]
) -> Array:
    """Return `lines.inputs` blocks of a period, every input of few levels of its own, (samples, r).

    The inputs have the powers of the lines. The samples beyond the last period continue it.
    """
    assert lines.period is not None
    period, r = lines.period, lines.inputs
    rms = np.sqrt(lines.mean_squares)
    roots = np.zeros((period // 2 + 1, r, r), dtype=complex)
    roots[np.rint(lines.frequencies * period / (2.0 * np.pi)).astype(int)] = lines.roots
    angles = low_peak_phases(
        lines, r * period, 2.0 * np.pi * rng.random(len(lines.powers)), powers=_EVEN, steps=_EVEN_STEPS
    )
    start = multisine_record(lines, r * period, rng, "orthogonal", angles=angles)

    def restored(levels: Array) -> tuple[Array, float]:
        transform = np.fft.rfft(levels.reshape(r, period, r), axis=1).transpose(1, 2, 0)
        wanted = _restored(roots, transform, period)
        size = float(np.vdot(transform, transform).real)
        fit = float(np.vdot(transform, wanted).real) / size if size > 0.0 else 0.0
        blocks = np.fft.irfft(wanted.transpose(2, 0, 1), period, axis=1)
        return blocks.reshape(r * period, r), float(np.sum(np.abs(wanted - fit * transform) ** 2))

    record = _alternate(start, lambda values: _each(values, nearest, rms), restored)
    edges = np.linspace(0, samples, r + 1).astype(int)
    lengths = np.diff(edges)
    return np.concatenate(
        [record[b * period + np.arange(length) % period] for b, length in enumerate(lengths)]
    )


def _alternate(
    start: Array, nearest: Callable[[Array], Array], restored: Callable[[Array], tuple[Array, float]]
) -> Array:
    """Return the best signal of few levels among the iterates of the two projections."""
    levels = nearest(start)
    best, least = levels, np.inf
    for _ in range(_ROUNDS):
        wanted, misfit = restored(levels)
        if misfit < least:
            best, least = levels, misfit
        following = nearest(wanted)
        if np.array_equal(following, levels):
            break
        levels = following
    return best


def _restored(roots: ComplexArray, transform: ComplexArray, period: int) -> ComplexArray:
    """Return the matrices (L, r, r) of the wanted powers nearest to the blocks' transforms (columns)."""
    line = np.full(len(roots), np.sqrt(0.5))
    line[0] = 1.0
    if period % 2 == 0:
        line[-1] = 1.0
    # Columns of the orthogonal multisine: vectors root(P) q_b, q of modulus sqrt(r) in all.
    size = line * period * np.sqrt(roots.shape[1])
    return np.asarray(size[:, None, None] * (roots @ _unitary(roots @ transform)))


def _unitary(matrices: ComplexArray) -> ComplexArray:
    """Return the unitary factors of the polar decompositions of matrices, (L, r, r)."""
    if matrices.shape[-1] == 1:
        return np.exp(1j * np.angle(matrices))
    left, _, right = np.linalg.svd(matrices)
    return np.asarray(left @ right)


def signs(record: Array) -> Array:
    """Return the nearest multiple of a signal of -1 and 1."""
    return np.where(record >= 0.0, 1.0, -1.0)


def signs_and_zeros(record: Array) -> Array:
    """Return the nearest multiple of a signal of -1, 0, 1: the m largest values are kept, m the best."""
    size = np.abs(record)
    order = np.sort(size)[::-1]
    kept = np.argmax(np.cumsum(order) / np.sqrt(np.arange(1, size.size + 1)))
    return np.where(size >= order[kept], np.sign(record), 0.0)


def _each(values: Array, nearest: Callable[[Array], Array], rms: Array) -> Array:
    """Return the nearest levels input by input, of the wanted root mean square."""
    columns = []
    for column, size in zip(values.T, rms, strict=True):
        levels = nearest(column) if size > 0.0 else np.zeros_like(column)
        now = float(np.sqrt(np.mean(levels**2)))
        columns.append(levels * (size / now) if now > 0.0 else levels)
    return np.stack(columns, axis=1)


BINARY = FewLevels(signs, few_levels=True, switched=True)
SLEWED = FewLevels(signs, slewed=True)
TERNARY = FewLevels(signs_and_zeros, few_levels=True)
