"""signal.png: the record to be applied, and how its values are distributed."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLUE, DASHED, GREY, ORANGE, lowered
from inputdesign_cli.runs.curves import SignalCurves
from inputdesign_cli.runs.results import Array

SHOWN = 1000  # samples that a figure of this width can show one by one
STEPS_TO = 300  # up to here the hold between samples is visible
ROWS = 4  # channels that fit
MARGIN = 0.08  # above and below, of what is shown


def draw_signal(page: Figure, curves: SignalCurves, time_unit: str) -> None:
    """Each channel against time, its first samples if the record is long, beside a histogram of all of it."""
    channels = list(curves.channels.items())[:ROWS]
    samples = curves.time.size
    shown = min(samples, SHOWN)
    grid = page.subplots(len(channels), 2, sharey="row", squeeze=False, width_ratios=[5, 1])
    for (name, values), (record, histogram) in zip(channels, grid, strict=True):
        _draw_record(record, curves.time[:shown], values[:shown])
        label, symbol = curves.labels.get(name, ""), f"{name[0]}{lowered(name[1:])}(t)"
        nameless = not label or label.startswith("(")  # a unit alone
        record.set_ylabel(f"{symbol} {label}".strip() if nameless else label)
        _draw_histogram(histogram, values)
        for bound in curves.limits.get(name, ()):
            for axes in (record, histogram):
                axes.axhline(bound, color=ORANGE, linewidth=1.0, linestyle=DASHED)
        reached = [float(values.min()), float(values.max()), *curves.limits.get(name, ())]
        low, high = min(reached), max(reached)
        if high > low:
            record.set_ylim(low - MARGIN * (high - low), high + MARGIN * (high - low))
    last, counts = grid[-1]
    last.set_xlabel(f"time ({time_unit})")
    counts.set_xlabel("share (%)")
    for record, histogram in grid[:-1]:
        record.tick_params(labelbottom=False)
        histogram.tick_params(labelbottom=False)
    part = f"first {shown} of {samples} samples" if shown < samples else f"{samples} samples"
    if len(channels) < len(curves.channels):
        part += f", {len(channels)} of {len(curves.channels)} channels"
    grid[0][0].set_title(part, loc="left", color=GREY)


def _draw_record(axes: Axes, time: Array, values: Array) -> None:
    steps = "steps-post" if values.size <= STEPS_TO else "default"
    axes.plot(time, values, color=BLUE, linewidth=0.9, drawstyle=steps)
    axes.set_xlim(time[0], time[-1])


def _draw_histogram(axes: Axes, values: Array) -> None:
    weights = np.full(values.size, 100.0 / values.size)
    bins = min(40, max(10, int(np.sqrt(values.size))))
    axes.hist(values, bins=bins, weights=weights, orientation="horizontal", color=BLUE, alpha=0.75)
    axes.tick_params(labelleft=False)
