"""Phases of a multisine of several inputs that keep all of them, and what they cause, low at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.channels import Lines, block_vectors, blocks_of
from inputdesign_cli.signal.crest import POWERS, STEPS, optimise_phases
from inputdesign_cli.signal.sinusoids import Sinusoids


def schroeder_angles(lines: Lines, samples: int) -> Array:
    """(L,): Schroeder's phases of the total power, common to all inputs and periods."""
    return _common(lines, samples).schroeder_phases()


def low_peak_angles(
    lines: Lines,
    samples: int,
    start: Array,
    *,
    amplitude: Array | None = None,
    rate: Array | None = None,
    outputs: Sequence[tuple[ComplexArray, float]] = (),
    powers: Sequence[int] = POWERS,
    steps: int = STEPS,
) -> Array:
    """(L,): the common phases of the lines for which the joint peak over inputs and periods is low.

    Args:
        samples: of the whole record, in as many periods as there are inputs.
        start: (L,), where to begin.
        amplitude: (r,), what each input may reach; its root mean square when nothing is limited.
        rate: (r,), what each may move from one value to the next; any distance when not given.
        outputs: rows (L, r) of responses at the lines, each with what that signal may reach.
        powers, steps: see `optimise_phases`.
    """
    inputs = lines.inputs
    blocks = blocks_of("orthogonal", inputs)
    rms = np.sqrt(lines.mean_squares)
    moves = 1.0 - np.exp(-1j * lines.frequencies)
    scale = np.where(rms > 0, rms, 1.0) if amplitude is None else amplitude
    gains: list[ComplexArray] = []
    for block in range(blocks):
        vectors = block_vectors(lines, samples, block)
        if amplitude is not None or (rate is None and not outputs):
            gains += [vectors[:, a] / scale[a] for a in range(inputs) if rms[a] > 0]
        if rate is not None:
            gains += [moves * vectors[:, a] / rate[a] for a in range(inputs) if rms[a] > 0]
        gains += [np.einsum("na,na->n", row, vectors) / bound for row, bound in outputs]
    unit = _common(lines, samples, unit=True)
    return optimise_phases(unit, start, gains=gains, powers=powers, steps=steps)


def _common(lines: Lines, samples: int, *, unit: bool = False) -> Sinusoids:
    """One period of the lines with their total powers, or with power one each."""
    period = samples // lines.inputs
    powers = np.ones(lines.frequencies.size) if unit else np.einsum("naa->n", lines.powers).real
    on_grid = lines.period == period
    harmonics = np.rint(lines.frequencies * period / (2 * np.pi)).astype(np.int_) if on_grid else None
    return Sinusoids(lines.frequencies, powers, period, harmonics)
