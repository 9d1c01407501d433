"""The sinusoids that stand for a density in a record of a finite length."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channels import ChannelPhases, Lines, blocks_of, grid_lines
from inputdesign_cli.spectrum import TabulatedChannels

# Samples of a period with fewer lines than this stand for nothing.
_SHORTEST = 8


def density_lines(
    basis: TabulatedChannels, powers: Array, samples: int, step: float, phases: ChannelPhases
) -> Lines | None:
    """The lines of a record of `samples`, scaled to the powers (r,) of all channels together.

    Args:
        step: time between samples in the unit of the density's frequencies.
        phases: how they are chosen over the channels.

    Returns:
        None for a record too short, or a band between two lines of the record.
    """
    blocks = blocks_of(phases, basis.inputs)
    if samples < _SHORTEST * blocks:
        return None
    period = samples // blocks
    w = 2.0 * np.pi * np.arange(period // 2 + 1) / (period * step)
    lines = grid_lines(basis.density(np.ones(1), w), period, step)
    total = float(np.trace(lines.powers.sum(axis=0)).real)
    return None if total == 0.0 else lines.scaled(float(np.sum(powers)) / total)
