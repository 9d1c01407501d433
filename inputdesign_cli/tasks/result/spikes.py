"""What to say of single samples that decide what a record says."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.identification import Estimate, spikes
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.build.data import Data

_SHOWN = 5


def spike_notes(units: Units, estimate: Estimate, data: Data) -> list[str]:
    """A sentence for every output in whose residuals a few samples hold most of the sum of squares."""
    ends = np.cumsum([samples for _, samples in data.files])
    told = []
    for one in spikes(estimate.errors):
        places = []
        for at in one.samples[:_SHOWN]:
            file = int(np.searchsorted(ends, at, side="right"))
            of = f" of {data.files[file][0]}" if len(data.files) > 1 else ""
            places.append(f"{data.time[at]:.10g} {units.time_unit}{of}")
        many, output = len(one.samples), f"y{one.output + 1}" if units.outputs > 1 else "y"
        told.append(
            f"{many} of {len(estimate.errors)} samples of {output} hold{'s' * (many == 1)} "
            f"{100 * one.share:.3g} % of the squares of its residuals (at {', '.join(places)}"
            f"{', ..' * (many > _SHOWN)}): spikes, or events that the model does not know, decide what "
            "these data say; empty the cells that are faults of measurement, which cuts the record there, "
            "and try again"
        )
    return told
