"""From a matrix spectrum to the record of several inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.information import POWER_KINDS, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channel_bounds import ChannelBounds, channel_limiter
from inputdesign_cli.signal.channel_draw import ChannelSignalGenerator
from inputdesign_cli.signal.channel_information import RecordFilter
from inputdesign_cli.signal.selection import Candidates, Evaluator, Record, Target, best_record
from inputdesign_cli.signal.settings import Quantiser


def realise_channels(
    plant: RecordFilter,
    drawer: ChannelSignalGenerator,
    demand: Target,
    *,
    total: float,
    bounds: ChannelBounds | None = None,
    quantisers: Sequence[Quantiser | None] | None = None,
) -> Record:
    """The best of several records (n, r), see `best_record`.

    Args:
        plant: for records of the length of the drawer's.
        total: the power of the design, of all inputs.
        quantisers: the converter of each input.
    """
    bounds = bounds or ChannelBounds()

    def powers(record: Array) -> Mapping[PowerKind, Array]:
        return {kind: np.mean(plant.signals(kind, record) ** 2, axis=0) for kind in POWER_KINDS}

    converters = quantisers or [None] * plant.experiment.inputs
    limiter = channel_limiter(plant, drawer.recipe, bounds, converters)
    shape = Candidates(drawer.values, drawer.recipe.method, total)
    return best_record(shape, limiter, Evaluator(plant.information, powers, bounds.powers), demand)
