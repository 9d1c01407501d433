"""signal.png: the record to be applied, how its values are distributed, and what it is to cause."""

from __future__ import annotations

from itertools import chain, product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLUE, DASHED, GREEN, GREY, ORANGE, legend_over_all, lowered
from inputdesign_cli.outcome.curves import PredictedPanel, SignalCurves
from inputdesign_cli.outcome.results import Array

SHOWN = 1000  # samples that a figure of this width can show one by one
ROWS = 4  # channels that fit, of the record and of the outputs together
MARGIN = 0.08  # above and below, as a share of the range shown
_HIGHER = 0.25  # of the page, for each row beyond the second
_BAND = 2.0  # standard deviations
_LIMIT: dict[str, Any] = {"color": ORANGE, "linewidth": 1.2, "linestyle": DASHED}


def draw_signal(page: Figure, curves: SignalCurves, time_unit: str) -> None:
    """Each channel against time, its first samples if the record is long, beside a histogram of all of it.

    Below them the outputs that are to be expected, from rest, with two standard deviations of noise.
    """
    predicted = curves.predicted[: ROWS // 2]
    channels = list(curves.channels.items())[: ROWS - len(predicted)]
    rows = len(channels) + len(predicted)
    page.set_figheight((1.0 + _HIGHER * max(rows - 2, 0)) * page.get_figheight())
    samples = curves.time.size
    shown = min(samples, SHOWN)
    time = curves.time[:shown]
    grid = page.subplots(rows, 2, sharex="col", squeeze=False, width_ratios=[5, 1])
    applied: dict[str, Any] = {"color": BLUE, "linewidth": 0.9, "markersize": 4, "label": "to be applied"}
    if curves.held:
        applied |= {"drawstyle": "steps-post", "label": "to be applied, held between samples"}
    for (name, values), (record, histogram) in zip(channels, grid, strict=False):
        record.plot(time, values[:shown], _mark(time), **applied)
        _name(record, name, curves.labels.get(name, ""), "")
        limits = curves.limits.get(name, ())
        for bound, axes in product(limits, (record, histogram)):
            axes.axhline(bound, label="limits", **_LIMIT)
        if name in curves.moves:
            record.set_title("largest move {:.4g}, limit {:.4g}".format(*curves.moves[name]), loc="left")
        _frame(record, values, *limits)
        _draw_histogram(histogram, values, record.get_ylim())
    for panel, (below, beside) in zip(predicted, grid[len(channels) :], strict=True):
        _draw_predicted(below, time, panel, levels=curves.levels)
        beside.set_axis_off()
    for record, _ in grid[:-1]:
        record.tick_params(labelbottom=False)
    last, counts = grid[-1][0], grid[len(channels) - 1][1]
    if shown > 1:
        last.set_xlim(time[0], time[-1])
    part = f"{samples} samples" if shown == samples else f"first {shown} of {samples} samples"
    if len(channels) < len(curves.channels):
        part += f", {len(channels)} of {len(curves.channels)} channels"
    last.set_xlabel(f"time ({time_unit}); {part}")
    counts.tick_params(labelbottom=True)
    grid[0][1].set_title("share (%)", loc="left")
    legend_over_all(page)


def _mark(time: Array) -> str:
    """How a signal is drawn: a single sample makes no line."""
    return "-" if time.size > 1 else "o"


def _name(axes: Axes, name: str, label: str, what: str) -> None:
    """The user's name and unit of a channel, or its symbol with the unit."""
    symbol = f"{name[0]}{lowered(name[1:])}(t)"
    nameless = not label or label.startswith("(")  # a unit alone
    axes.set_ylabel(f"{what}{symbol} {label}".strip() if nameless else f"{what}{label}")


def _draw_predicted(axes: Axes, time: Array, panel: PredictedPanel, *, levels: bool) -> None:
    y, noise = panel.values[: time.size], _BAND * panel.deviation[: time.size]
    label = f"± 2 standard deviations of noise{' since the start' if noise[0] < noise[-1] else ''}"
    axes.fill_between(time, y - noise, y + noise, color=GREY, alpha=0.3, linewidth=0, label=label)
    # The level of the output at rest is not known, that of the input is: one axis has levels, one deviations.
    said = "predicted output, deviation Δ from rest" if levels else "predicted output, from rest"
    axes.plot(time, y, _mark(time), color=GREEN, linewidth=1.0, markersize=4, label=said)
    for bound in panel.limits or ():
        axes.axhline(bound, label="limits", **_LIMIT)
    _name(axes, panel.name, panel.label, "Δ " if levels else "")
    _frame(axes, y - noise, y + noise, *(panel.limits or ()))


def _frame(axes: Axes, *shown: Array | float) -> None:
    """The limits of an axis about what is shown."""
    reached = list(chain.from_iterable((np.min(part), np.max(part)) for part in shown))
    low, high = float(min(reached)), float(max(reached))
    if high == low:  # a constant is seen beside zero
        low, high = (min(low, 0.0), max(high, 0.0)) if high else (-1.0, 1.0)
    axes.set_ylim(low - MARGIN * (high - low), high + MARGIN * (high - low))


def _draw_histogram(axes: Axes, values: Array, shown: tuple[float, float]) -> None:
    weights = np.full(values.size, 100.0 / values.size)
    bins = min(40, max(10, int(np.sqrt(values.size))))
    ends = (float(values.min()), float(values.max()))
    ends = ends if ends[1] > ends[0] else shown
    axes.hist(
        values, bins=bins, range=ends, weights=weights, orientation="horizontal", color=BLUE, alpha=0.75
    )
    axes.tick_params(labelleft=False)
    axes.set_ylim(shown)
