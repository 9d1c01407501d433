"""Figures over time: the record to be applied, and a model against the data of an experiment."""

from __future__ import annotations

import textwrap
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures import style
from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, DOTTED, GREEN, GREY, ORANGE
from inputdesign_cli.outcome.curves import FitCurves, FitPanel, PredictedPanel, ResidualCurves, SignalCurves
from inputdesign_cli.outcome.results import Array

_ONE_BY_ONE = 1000  # samples that a figure of this width can show
_ROWS = 4  # channels that fit, of the record and of the outputs together
_MARGIN = 0.08  # above and below, as a share of the range shown
_HIGHER = 0.25  # share of the page height for each row beyond the second
_BAND = 2.0  # standard deviations
# A fixed number of steps: the layout is made for the tick labels at the first height.
_STEPS: dict[str, Any] = {"nbins": 4, "steps": [1, 2, 5, 10]}
_LIMIT: dict[str, Any] = {"color": ORANGE, "linewidth": 1.2, "linestyle": DASHED, "label": "limits"}
# Samples beyond which a part of a record is also shown enlarged, and samples of that part.
_WHOLE, _PART = 600, 400
_AS_LIVELY = 0.5  # share of the largest variance from which on the first part is taken
_POINTS = 3000  # points of a curve that a page can show
_GAP = 1.5  # sample times between two records that follow each other


def draw_signal(page: Figure, curves: SignalCurves, time_unit: str) -> None:
    """Draw each channel over time (of a long record the first samples), beside a histogram of all samples.

    Below them are the expected inputs of a loop and outputs, with two standard deviations of noise.
    """
    predicted = curves.predicted[: _ROWS // 2]
    channels = list(curves.channels.items())[: _ROWS - len(predicted)]
    rows = len(channels) + len(predicted)
    page.set_figheight((1.0 + _HIGHER * max(rows - 2, 0)) * page.get_figheight())
    samples, time = curves.time.size, curves.time[:_ONE_BY_ONE]
    grid = page.subplots(rows, 2, sharex="col", squeeze=False, width_ratios=[5, 1])
    single = {"marker": "o", "markersize": 4} if time.size == 1 else {}
    applied: dict[str, Any] = {"color": BLUE, "linewidth": 0.9, "label": "to be applied", **single}
    if curves.held:
        applied |= {"drawstyle": "steps-post", "label": "to be applied, held between samples"}
    for (name, values), (record, histogram) in zip(channels, grid, strict=False):
        record.plot(time, values[: time.size], **applied)
        _name(record, name, curves.labels.get(name, ""), "")
        limits = curves.limits.get(name, ())
        for bound, axes in product(limits, (record, histogram)):
            axes.axhline(bound, **_LIMIT)
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
    if time.size > 1:
        last.set_xlim(time[0], time[-1])
    part = f"{samples} samples" if time.size == samples else f"first {time.size} of {samples} samples"
    if len(channels) < len(curves.channels):
        part += f", {len(channels)} of {len(curves.channels)} channels"
    last.set_xlabel(f"time ({time_unit}); {part}")
    counts.tick_params(labelbottom=True)
    grid[0][1].set_title("share (%)", loc="left")
    style.legend_over_all(page)


def _name(axes: Axes, name: str, label: str, what: str) -> None:
    """Label the axis with the user's name and unit of a channel, or with its symbol and unit."""
    symbol = f"{name[0]}{style.lowered(name[1:])}(t)"
    nameless = not label or label.startswith("(")  # a unit alone
    said = f"{what}{symbol} {label}".strip() if nameless else f"{what}{label}"
    axes.set_ylabel(textwrap.fill(said, max(3 * axes.yaxis.get_tick_space(), 1)))  # letters for each tick


def _draw_predicted(axes: Axes, time: Array, panel: PredictedPanel, *, levels: bool) -> None:
    y, noise = panel.values[: time.size], _BAND * panel.deviation[: time.size]
    label = f"± 2 standard deviations of noise{' since the start' if noise[0] < noise[-1] else ''}"
    style.band(axes, time, y - noise, y + noise, GREY, 0.3, label=label)
    # The level at rest is known for inputs only: their axis has levels, and that of outputs has deviations.
    what = f"predicted {'input' if panel.applied else 'output'}"
    levels = levels and not panel.applied
    said = what if panel.applied else f"{what}, {'deviation Δ ' if levels else ''}from rest"
    axes.plot(
        time,
        y,
        "-" if time.size > 1 else "o",
        color=BLACK if panel.applied else GREEN,
        linewidth=1.0,
        markersize=4,
        label=said,
    )
    for bound in panel.limits or ():
        axes.axhline(bound, **_LIMIT)
    _name(axes, panel.name, panel.label, "Δ " if levels else "")
    _frame(axes, y - noise, y + noise, *(panel.limits or ()))


def _frame(axes: Axes, *shown: Array | float) -> None:
    """Set the limits of the vertical axis around the values that are shown."""
    low, high = (float(end([end(part) for part in shown])) for end in (np.min, np.max))
    if high == low:  # a constant is seen beside zero
        low, high = (min(low, 0.0), max(high, 0.0)) if high else (-1.0, 1.0)
    axes.set_ylim(low - _MARGIN * (high - low), high + _MARGIN * (high - low))
    axes.locator_params(axis="y", **_STEPS)


def _draw_histogram(axes: Axes, values: Array, shown: tuple[float, float]) -> None:
    weights = np.full(values.size, 100.0 / values.size)
    bins = min(40, max(10, int(np.sqrt(values.size))))
    ends = (float(values.min()), float(values.max()))
    ends = ends if ends[1] > ends[0] else shown
    drawn: dict[str, Any] = {"orientation": "horizontal", "color": BLUE, "alpha": 0.75}
    axes.hist(values, bins=bins, range=ends, weights=weights, **drawn)
    axes.tick_params(labelleft=False)
    axes.set_ylim(shown)
    axes.locator_params(axis="y", **_STEPS)


def draw_fit(page: Figure, curves: FitCurves, time_unit: str) -> None:
    """Draw each output with its simulation and its one-step prediction over the whole record.

    Below a single output are its residuals and, of a long record, the part in which it moves most. No curve
    goes from one record to the next: gaps are shaded, and other borders are dotted.
    """
    single, size = len(curves.panels) == 1, curves.time.size
    whole = closer = slice(0, size)
    heights = [2] * len(curves.panels) + [1] * single
    if single and size > _WHOLE:
        closer = _liveliest(curves.panels[0].y)
        heights.append(2)
        page.set_figheight((1.0 + _HIGHER) * page.get_figheight())
    axes = page.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
    places = [(place, panel, whole) for place, panel in zip(axes, curves.panels, strict=False)]
    if closer != whole:
        places.append((axes[2], curves.panels[0], closer))
    for place, panel, part in places:
        _draw_outputs(place, curves, panel, part, single=single)
    if single:
        residual = curves.panels[0].y - curves.panels[0].predicted
        axes[1].plot(*_drawn(curves, residual, whole), color=BLUE, linewidth=0.8)
        axes[1].set_ylabel("residual")
        axes[1].locator_params(axis="y", **_STEPS)
    ends = np.concatenate([curves.time[[0, -1]], curves.left_out])
    over, last = (axes[:2], axes[1]) if single else (axes, axes[-1])
    for place in axes:
        _mark_borders(place, curves)
    for place in over:
        place.set_xlim(ends.min(), ends.max())
        place.tick_params(labelbottom=place is last)
    last.set_xlabel(f"time ({time_unit})")
    if closer != whole:
        axes[2].set_xlim(*curves.time[[closer.start, closer.stop - 1]])
        axes[2].set_xlabel(f"time ({time_unit}); samples {closer.start + 1} to {closer.stop} of {size}")
    style.legend_over_all(page)


def _liveliest(y: Array) -> slice:
    """Return the window of a long output (n,) in which it varies most; the first one if that is as lively."""
    begins = np.arange(0, y.size - _PART + 1, _PART // 4)
    moves = np.nanvar(np.lib.stride_tricks.sliding_window_view(y, _PART)[begins], axis=1)
    begin = 0 if moves[0] >= _AS_LIVELY * moves.max() else int(begins[np.argmax(moves)])
    return slice(begin, begin + _PART)


def _drawn(curves: FitCurves, values: Array, part: slice) -> tuple[Array, Array]:
    """Return times and values of a part of (n,) as a page can show them, with a gap between two records."""
    at, begins = np.arange(part.start, part.stop), np.cumsum(curves.lengths, dtype=np.int64)[:-1]
    if at.size > _POINTS:  # keep a gap, the least and the largest value for each column of the page
        gap = np.isnan(values)
        marked = (gap, np.where(gap, -np.inf, -values), np.where(gap, -np.inf, values))
        columns = np.array_split(at, _POINTS // 3)
        at = np.unique([column[np.argmax(mark[column])] for column in columns for mark in marked])
    gaps = np.searchsorted(at, begins[(begins > part.start) & (begins < part.stop)])
    return np.insert(curves.time[at], gaps, np.nan), np.insert(values[at], gaps, np.nan)


def _draw_outputs(place: Axes, curves: FitCurves, panel: FitPanel, part: slice, *, single: bool) -> None:
    """Draw an output, its prediction and, in dashes that let the others show, its simulation."""
    name, percent = f"y{panel.output + 1}", "" if panel.fit is None else f"fit {panel.fit:.1f} %"
    simulated = "simulated from u" + (f" ({percent})" if single and percent else "")
    place.plot(*_drawn(curves, panel.y, part), color=BLACK, linewidth=1.6, label="recorded")
    place.plot(
        *_drawn(curves, panel.predicted, part), color=BLUE, linewidth=1.0, label="predicted one step ahead"
    )
    if panel.simulated is not None:
        x, y = _drawn(curves, panel.simulated, part)
        place.plot(x, y, color=ORANGE, linewidth=1.2, linestyle=DASHED, label=simulated)
    if panel.left_out is not None and part.stop - part.start == curves.time.size:
        place.plot(curves.left_out, panel.left_out, ".", color=GREY, markersize=2, label="left out")
    if panel.label:
        _name(place, name, panel.label, "")
    else:
        place.set_ylabel("output")
    if not single:
        place.set_title(", ".join(filter(None, (name, percent))), loc="left", color=GREY)
        place.set_label(name)


def _mark_borders(place: Axes, curves: FitCurves) -> None:
    """Shade the gaps between records, and draw a dotted line where one follows the other at once."""
    step = float(np.median(np.diff(curves.time))) if curves.time.size > 1 else 0.0
    for begin in np.cumsum(curves.lengths, dtype=np.int64)[:-1].tolist():
        before, after = curves.time[begin - 1 : begin + 1].tolist()
        if after - before > _GAP * step:
            place.axvspan(before, after, color=GREY, alpha=0.15, linewidth=0, label="not in the estimate")
        else:
            at = 0.5 * (before + after)
            place.axvline(at, color=GREY, linestyle=DOTTED, linewidth=1.2, label="another record begins")


def draw_residuals(page: Figure, curves: ResidualCurves, time_unit: str) -> None:
    """Draw residual autocorrelations and correlations with past inputs, with 99 % bands of a right model.

    Each output has a row, each residual and each input a column.
    """
    _, p, r = curves.cross_correlation.shape
    grid = page.subplots(p, p + r, sharex=True, sharey=True, squeeze=False)
    own = [(f"residual {j + 1}", curves.lags, curves.autocorrelation[..., j]) for j in range(p)]
    past = [(f"u{j + 1}", curves.input_lags, curves.cross_correlation[..., j]) for j in range(r)]
    for j, (name, lags, values) in enumerate([*own, *past]):
        for i in range(p):
            axes = grid[i][j]
            axes.axhspan(-curves.limit, curves.limit, color=GREY, alpha=0.2, linewidth=0)
            axes.vlines(lags, 0.0, values[:, i], color=BLUE, linewidth=1.6)
            axes.plot(lags, values[:, i], "o", color=BLUE, markersize=4)
            axes.axhline(0.0, color=BLACK, linewidth=0.6)
            grid[i][0].set_ylabel(f"residual {i + 1}")
        grid[0][j].set_title(f"with {name}", color=GREY)
        grid[-1][j].set_xlabel("lag (samples)")
    page.suptitle(
        f"correlations of the residuals; probabilities\n{curves.whiteness:.2g} (among each other), "
        f"{curves.independence:.2g} (with inputs)",
        x=0.01,
        ha="left",
    )
