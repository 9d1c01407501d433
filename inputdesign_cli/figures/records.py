"""Figures over time: the record to be applied, and a model against the data of an experiment."""

from __future__ import annotations

from collections.abc import Sequence
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
_HIGHER = 0.25  # of the page, for each row beyond the second
_BAND = 2.0  # standard deviations
_LIMIT: dict[str, Any] = {"color": ORANGE, "linewidth": 1.2, "linestyle": DASHED, "label": "limits"}
# A record up to the first length is drawn whole, of a longer one the second number of samples.
_WHOLE, _PART = 600, 400
_AS_LIVELY = 0.5
_LINE = 2e-3  # the width of a curve, as a share of the height drawn


def draw_signal(page: Figure, curves: SignalCurves, time_unit: str) -> None:
    """Draw each channel over time (of a long record the first samples), beside a histogram of all samples.

    Below them are the outputs that are expected from rest, with two standard deviations of noise.
    """
    predicted = curves.predicted[: _ROWS // 2]
    channels = list(curves.channels.items())[: _ROWS - len(predicted)]
    rows = len(channels) + len(predicted)
    page.set_figheight((1.0 + _HIGHER * max(rows - 2, 0)) * page.get_figheight())
    samples, time = curves.time.size, curves.time[:_ONE_BY_ONE]
    grid = page.subplots(rows, 2, sharex="col", squeeze=False, width_ratios=[5, 1])
    applied: dict[str, Any] = {"color": BLUE, "linewidth": 0.9, "markersize": 4, "label": "to be applied"}
    if curves.held:
        applied |= {"drawstyle": "steps-post", "label": "to be applied, held between samples"}
    for (name, values), (record, histogram) in zip(channels, grid, strict=False):
        record.plot(time, values[: time.size], _mark(time), **applied)
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


def _mark(time: Array) -> str:
    """Return the format of a signal's curve: a line, or a dot for a single sample."""
    return "-" if time.size > 1 else "o"


def _name(axes: Axes, name: str, label: str, what: str) -> None:
    """Label the axis with the user's name and unit of a channel, or with its symbol and unit."""
    symbol = f"{name[0]}{style.lowered(name[1:])}(t)"
    nameless = not label or label.startswith("(")  # a unit alone
    axes.set_ylabel(f"{what}{symbol} {label}".strip() if nameless else f"{what}{label}")


def _draw_predicted(axes: Axes, time: Array, panel: PredictedPanel, *, levels: bool) -> None:
    y, noise = panel.values[: time.size], _BAND * panel.deviation[: time.size]
    label = f"± 2 standard deviations of noise{' since the start' if noise[0] < noise[-1] else ''}"
    style.band(axes, time, y - noise, y + noise, GREY, 0.3, label=label)
    # The level of the output at rest is not known, that of the input is: one axis has levels, one deviations.
    said = "predicted output, deviation Δ from rest" if levels else "predicted output, from rest"
    axes.plot(time, y, _mark(time), color=GREEN, linewidth=1.0, markersize=4, label=said)
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


def _draw_histogram(axes: Axes, values: Array, shown: tuple[float, float]) -> None:
    weights = np.full(values.size, 100.0 / values.size)
    bins = min(40, max(10, int(np.sqrt(values.size))))
    ends = (float(values.min()), float(values.max()))
    ends = ends if ends[1] > ends[0] else shown
    drawn: dict[str, Any] = {"orientation": "horizontal", "color": BLUE, "alpha": 0.75}
    axes.hist(values, bins=bins, range=ends, weights=weights, **drawn)
    axes.tick_params(labelleft=False)
    axes.set_ylim(shown)


def _stretch(outputs: Sequence[Array]) -> slice:
    """Return the first samples of outputs (n,), or the window where they vary most, if that is far more."""
    size = len(outputs[0])
    if size <= _WHOLE:
        return slice(0, size)
    begins = np.arange(0, size - _PART + 1, _PART // 4)
    moves = np.zeros(begins.size)
    for y in outputs:
        windows = np.lib.stride_tricks.sliding_window_view(y, _PART)[begins]
        moves += np.nanvar(windows, axis=1) / max(float(np.nanvar(y)), 1e-300)
    best = int(np.argmax(moves))
    begin = 0 if moves[0] >= _AS_LIVELY * moves[best] else int(begins[best])
    return slice(begin, begin + _PART)


def draw_fit(page: Figure, curves: FitCurves, time_unit: str) -> None:
    """Draw each output with its simulation and its one-step prediction; below a single output its residuals.

    Records are parted: no curve goes from one to the next, and their borders are marked.
    """
    single = len(curves.panels) == 1
    rows = 2 if single else len(curves.panels)
    axes = page.subplots(rows, 1, sharex=True, squeeze=False, height_ratios=[2, 1] if single else None)[:, 0]
    part, size, unit = _stretch([panel.y for panel in curves.panels]), curves.time.size, time_unit
    begins = np.cumsum(curves.lengths, dtype=np.int64)[:-1]
    begins = begins[(begins > part.start) & (begins < part.stop)] - part.start

    def shown(values: Array) -> Array:
        return np.insert(values[part], begins, np.nan)  # no curve goes from one record to the next

    if part.stop - part.start < size:
        told = f"samples {part.start + 1} to {part.stop}" if part.start else f"first {_PART}"
        unit = f"{time_unit}; {told} of {size}{'' if part.start else ' samples'}"
    axes[-1].set_xlabel(f"time ({unit})")
    axes[-1].set_xlim(curves.time[part][0], curves.time[part][-1])
    time = shown(curves.time)
    same = all(_coincide(panel, part) for panel in curves.panels)
    for panel, place in zip(curves.panels, axes, strict=False):
        percent = "" if panel.fit is None else f"fit {panel.fit:.1f} %"
        recorded, simulated = ("y" if single else "recorded"), "simulated from u"
        if single and percent:
            simulated += f" ({percent})"
        place.plot(time, shown(panel.y), color=BLACK, linewidth=1.0, label=recorded)
        label = "predicted one step ahead" + f", and {simulated}" * same
        place.plot(time, shown(panel.predicted), color=BLUE, linewidth=1.0, label=label)
        if panel.simulated is not None and not same:
            place.plot(time, shown(panel.simulated), color=ORANGE, linewidth=1.0, label=simulated)
        if panel.label:
            _name(place, f"y{panel.output + 1}", panel.label, "")
        else:
            place.set_ylabel("output")
        if not single:
            name = f"y{panel.output + 1}"
            place.set_title(", ".join(filter(None, (name, percent))), loc="left", color=GREY)
            place.set_label(name)
    if single:
        (panel,) = curves.panels
        axes[1].plot(time, shown(panel.y - panel.predicted), color=BLUE, linewidth=0.8)
        axes[1].set_ylabel("residual")
    drawn = curves.time[part]
    borders = 0.5 * (drawn[begins - 1] + drawn[begins])
    for place, at in product(axes, borders.tolist()):
        place.axvline(at, color=GREY, linestyle=DOTTED, linewidth=1.2, label="another record begins")
    if single:
        style.legend_above(axes[0])
    else:
        style.legend_over_all(page)


def _coincide(panel: FitPanel, shown: slice) -> bool:
    """Return whether prediction and simulation are one curve to the eye, as where the noise is white."""
    if panel.simulated is None:
        return False
    y, predicted, simulated = panel.y[shown], panel.predicted[shown], panel.simulated[shown]
    width = _LINE * float(np.nanmax(y) - np.nanmin(y))
    return np.allclose(predicted, simulated, rtol=0.0, atol=width, equal_nan=True)


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
