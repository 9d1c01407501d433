"""The best of several records of several inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channel_level import ChannelBounds, levelled
from inputdesign_cli.signal.channels import ChannelPhases, Lines, multisine_record


@dataclass(frozen=True)
class ChannelRecord:
    """The samples (n, r) of the inputs, how their phases were chosen, and the score of the best draw.

    `short_of`: how many times higher its level would have to be, were there no limits on single samples.
    """

    samples: Array
    phases: ChannelPhases
    score: float
    short_of: float = 1.0


def realise_channels(
    experiment: ChannelExperiment,
    lines: Lines,
    score: Callable[[Array], float],
    *,
    samples: int,
    step: float,
    phases: ChannelPhases,
    candidates: int,
    seed: int,
    angles: Callable[[np.random.Generator], Array] | None = None,
    bounds: ChannelBounds | None = None,
    meets: bool = False,
) -> ChannelRecord:
    """The best record of several draws, each from its own stream of `seed`.

    Args:
        score: maps the information matrix of a record to what is to be small.
        candidates: how many draws.
        angles: draws the common phases of the lines (L,); uniform when not given.
        bounds: what the record may not exceed.
        meets: put each record to the least level at which its score is one; the one of least power among
            those that limits do not hold down is then the best. Otherwise the best has the lowest score.
    """
    best, least = None, (np.inf, np.inf)
    for stream in np.random.SeedSequence(seed).spawn(candidates):
        rng = np.random.default_rng(stream)
        drawn = None if angles is None else angles(rng)
        record = multisine_record(lines, samples, rng, phases, angles=drawn)
        try:
            found = levelled(experiment, record, step, score, bounds or ChannelBounds(), meets=meets)
            made = ChannelRecord(found.samples, phases, found.score, found.short_of)
            rank = (found.short_of, float(np.mean(found.samples**2)) if meets else found.score)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            made, rank = ChannelRecord(record, phases, np.inf), (np.inf, np.inf)
        if best is None or rank < least:
            best, least = made, rank
    if best is None:
        raise ValueError("at least one candidate is needed")
    return best
