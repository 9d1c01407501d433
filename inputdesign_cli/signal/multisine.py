"""Multisines of any number of inputs with any Hermitian spectrum: a root of its power matrix for every line.

Over one period a line is one complex vector, so that its spectrum has rank one whatever was designed.
A record of r periods whose vectors are orthogonal has, on average over them, the full matrix.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.signal.kind import Draft, SignalKind
from inputdesign_cli.signal.lines import Lines, orthogonal_columns
from inputdesign_cli.signal.phases import low_peak_phases, schroeder_phases
from inputdesign_cli.signal.settings import LineVectors, SignalSettings

_AT_ONCE = 1_000_000  # values of sinusoids computed together
# For more lines Schroeder's phases are nearly as good as optimised ones.
_OPTIMISED = 2000


class Multisine(SignalKind):
    """Sinusoids of exactly the wanted powers, with phases as the settings ask."""

    off_grid = True

    def blocks(self, settings: SignalSettings, inputs: int) -> int:
        """See `SignalKind`."""
        return blocks_of(settings.vectors, inputs)

    def draw(self, draft: Draft, rng: np.random.Generator) -> Array:
        """See `SignalKind`."""
        angles, vectors = self._phases(draft, rng), draft.settings.vectors
        return multisine_record(draft.lines, draft.samples, rng, vectors, angles=angles)

    def _phases(self, draft: Draft, rng: np.random.Generator) -> Array | None:
        """Return the common phases (L,) of the lines; None for uniform ones."""
        lines, samples, phases = draft.lines, draft.samples, draft.settings.phases
        if phases == "random" or phases == "orthogonal":
            return None
        if phases == "optimised":
            start = 2.0 * np.pi * rng.random(lines.frequencies.size)
        else:
            start = schroeder_phases(lines, samples)
        if phases == "schroeder" or (phases == "even" and lines.frequencies.size > _OPTIMISED):
            return start
        limited = [] if draft.limited is None else draft.limited(lines.frequencies)
        return low_peak_phases(lines, samples, start, limited=limited)


def blocks_of(vectors: LineVectors, inputs: int) -> int:
    """Return the number of periods in a record that have vectors of their own."""
    return inputs if vectors == "orthogonal" else 1


def multisine_record(
    lines: Lines, samples: int, rng: np.random.Generator, vectors: LineVectors, *, angles: Array | None = None
) -> Array:
    """Return one block after the other, each with the same random phase a line, (samples, r).

    Args:
        vectors: `orthogonal`: r blocks, line vectors root(P) e^{j psi} q_b with q_b the columns of an
            orthogonal matrix. `random`: one block, root(P) times independent uniform phases
            ([mohan-spectral], Appendix B, its misprints mended: uniform phases, sqrt(N), H_im); P is met on
            average only.
        angles: (L,) the phases psi, drawn uniformly when not given.
    """
    number, r = lines.powers.shape[:2]
    columns, real = orthogonal_columns(r), lines.real
    common = rng.random(number)
    edges = np.linspace(0, samples, blocks_of(vectors, r) + 1).astype(int)
    # At w = 0 and pi a sinusoid has no phase, only a sign, and its vector is real.
    turn = np.where(real, np.where(common < 0.5, 1.0, -1.0), np.exp(2j * np.pi * common))
    if angles is not None:
        turn = np.where(real, np.where(np.cos(angles) >= 0, 1.0, -1.0), np.exp(1j * angles))
    out = np.empty((samples, r))
    for block in range(edges.size - 1):
        if vectors == "random":
            mix = np.exp(2j * np.pi * rng.random((number, r)))
        else:
            mix = np.broadcast_to(columns[:, block], (number, r)).astype(complex)
        signs = np.where(rng.random((number, r)) < 0.5, 1.0, -1.0)
        mix = np.where(real[:, None] & np.any(np.abs(mix.imag) > 1e-12, axis=1)[:, None], signs, mix)
        amplitude = np.einsum("nab,nb->na", lines.roots, mix) * turn[:, None]
        out[edges[block] : edges[block + 1]] = _sinusoids(lines, amplitude, edges[block + 1] - edges[block])
    return out


def gaussian_record(lines: Lines, rng: np.random.Generator) -> Array:
    """Return Gaussian noise that is periodic, with random amplitudes at all of its harmonics, (period, r)."""
    assert lines.period is not None
    random = rng.standard_normal((2, len(lines.powers), lines.inputs))
    mix = np.where(lines.real[:, None], random[0], (random[0] + 1j * random[1]) / np.sqrt(2.0))
    return _sinusoids(lines, np.einsum("nab,nb->na", lines.roots, mix), lines.period)


def in_phase_record(frequencies: Array, amplitudes: Array, samples: int, rng: np.random.Generator) -> Array:
    """Return sinusoids of these amplitudes (L, r), each of one random phase in all channels, (samples, r).

    At 0 and pi a sinusoid is a constant or alternates; its sign is random.
    """
    phases = 2.0 * np.pi * rng.random(frequencies.size)
    real = (frequencies <= 0.0) | (frequencies >= np.pi)
    phases[real] = np.where(phases[real] < np.pi, 0.0, np.pi)
    return np.cos(np.outer(np.arange(samples), frequencies) + phases) @ amplitudes


def _sinusoids(lines: Lines, vectors: ComplexArray, samples: int) -> Array:
    """Return (samples, r), the sum of sinusoids with the mean squares of `vectors` (L, r)."""
    if lines.period is None:
        amplitude = np.where(lines.real, 1.0, np.sqrt(2.0))[:, None] * vectors
        return np.concatenate(
            [
                (np.exp(1j * np.outer(times, lines.frequencies)) @ amplitude).real
                for times in _pieces(samples, len(lines.frequencies))
            ]
        )
    spectrum = np.zeros((lines.period // 2 + 1, vectors.shape[1]), dtype=complex)
    index = np.rint(lines.frequencies * lines.period / (2 * np.pi)).astype(int)
    spectrum[index] = vectors * np.where(lines.real, 1.0, np.sqrt(0.5))[:, None] * lines.period
    one = np.fft.irfft(spectrum, lines.period, axis=0)
    return one if samples == lines.period else one[np.arange(samples) % lines.period]


def _pieces(samples: int, lines: int) -> Iterator[NDArray[np.int64]]:
    """Yield the numbers of the samples, as many at once as memory and the time limit allow."""
    for times in np.array_split(np.arange(samples), max(samples * lines // _AT_ONCE, 1)):
        seconds_left()
        yield times
