"""A record (samples, channels) of inputs without a model: its sizes, signal.csv and its plot."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome import Signal
from inputdesign_cli.outcome.curves import SignalCurves
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.units import Units


def signal_of(u: Array) -> Signal:
    """Return length, mean squares, peaks and crest factors by channel; the crest of a zero channel is 1."""
    power = np.mean(u * u, axis=0)
    peak = np.abs(u).max(axis=0)
    crest = np.divide(peak, np.sqrt(power), out=np.ones_like(peak), where=power > 0.0)
    return Signal(
        samples=len(u),
        power=tuple(power.tolist()),
        peak=tuple(peak.tolist()),
        crest_factor=tuple(crest.tolist()),
    )


def signal_results(units: Units, u: Array) -> tuple[Table, SignalCurves]:
    """Return signal.csv and its plot."""
    time = units.sample_time * np.arange(len(u), dtype=np.float64)
    channels = {f"u{i + 1}": samples for i, samples in enumerate(u.T)}
    return Table({units.time_header: time, **channels}), SignalCurves(time, channels)
