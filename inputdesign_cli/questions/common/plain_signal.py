"""A record (samples, channels) as it was made: its entry in `result.json`, signal.csv and its plot."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.curves import SignalCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units


def signal_entry(u: Array) -> dict[str, object]:
    """Length, mean squares, peaks and crest factors of the channels; one for a channel that is zero."""
    power = np.mean(u * u, axis=0)
    peak = np.abs(u).max(axis=0)
    crest = np.divide(peak, np.sqrt(power), out=np.ones_like(peak), where=power > 0.0)
    return {"samples": len(u), "power": power.tolist(), "peak": peak.tolist(), "crest_factor": crest.tolist()}


def signal_results(units: Units, u: Array) -> tuple[Table, SignalCurves]:
    """signal.csv and what its plot shows."""
    time = units.sample_time * np.arange(len(u), dtype=np.float64)
    channels = {f"u{i + 1}": samples for i, samples in enumerate(u.T)}
    return Table({units.time_header: time, **channels}), SignalCurves(time, channels)
