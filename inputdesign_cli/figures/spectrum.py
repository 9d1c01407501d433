"""spectrum.png, directions.png, optimality.png: where the design puts its power, how, and where it pays."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.typing import LineStyleType

from inputdesign_cli.figures import style
from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, GREEN, GREY, ORANGE, PALETTE
from inputdesign_cli.outcome.curves import DirectionCurves, OptimalityCurves, SpectrumCurves
from inputdesign_cli.outcome.results import Array

LOG_FROM = 100.0  # ratio of peak to white level from which on a density has a logarithmic axis
DECADES = 5.0  # decades shown below the peak: zeros of a spectrum would stretch the axis without end
# Entries of a nearly singular spectrum lie on each other: the dashes let the lower ones show through.
DASHES: tuple[LineStyleType, ...] = ("solid", (0, (4, 4)), (4, (4, 4)))
NOTHING = 1e-9  # share of the largest entry: smaller ones are rounding
MOST = 6  # curves that can be distinguished in one panel
FEW = 60  # lines that are drawn bold
_BESIDE = 1.1  # factor of the margins beside the outer lines


def draw_spectrum(page: Figure, curves: SpectrumCurves, time_unit: str) -> None:
    """Draw the input spectrum: the density or line powers, or of several inputs matrix and eigenvalues."""
    if curves.spectrum.shape[1] > 1:
        _draw_matrix(page, curves, time_unit)
        return
    axes = page.add_subplot()
    shown = curves.frequency > 0
    w, power = curves.frequency[shown], curves.spectrum[shown, 0, 0].real
    if curves.lines:
        few = w.size <= FEW
        total = f"sinusoids, total power {power.sum():.4g}"
        if curves.white is not None:
            total += f" (white: {curves.white:.4g})"
        axes.vlines(w, 0.0, power, color=BLUE, linewidth=1.8 if few else 0.8)
        axes.plot(w, power, "o", color=BLUE, markersize=5 if few else 2.5, label=total)
        axes.set_ylim(0.0, 1.08 * float(power.max(initial=0.0)) or 1.0)
        axes.set_ylabel(f"power of each sinusoid of {curves.symbol} (mean square)")
        margins = [] if curves.band is None or not w.size else [w.min() / 3, curves.band[1]]
        w = np.append(w, margins) if margins else _room(w)
    else:
        phi = f"Φ{style.lowered(curves.symbol)}"
        axes.plot(w, power, color=BLUE, linewidth=2.0, label=f"{phi}, {curves.label}")
        if curves.record is not None:
            record = curves.record[shown, 0]
            axes.plot(w, record, color=GREEN, linewidth=1.0, alpha=0.8, label="record, smoothed")
        _plot_white(axes, curves.white, f"{phi}, white")
        axes.set_ylabel(f"spectral density {phi}(ω)")
        _scale(axes, power, curves.white or float(np.median(power)))
    style.frequency_axis(axes, w, time_unit)
    style.legend_above(axes)


def _draw_matrix(page: Figure, curves: SpectrumCurves, time_unit: str) -> None:
    """Draw the moduli of the entries of the spectrum above, its eigenvalues (power by direction) below."""
    w, r = curves.frequency, curves.spectrum.shape[1]
    entries = np.asarray(np.abs(curves.spectrum), dtype=float)
    pairs = [(i, i) for i in range(r)] + [(i, j) for i in range(r) for j in range(i + 1, r)]
    above, below = page.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    peaks = np.max(entries, axis=0, initial=0.0)
    there = [(i, j) for i, j in pairs if i == j or peaks[i, j] > NOTHING * peaks.max()]
    for number, (i, j) in enumerate(there[:MOST]):
        label = f"|Φ{style.lowered(i + 1, j + 1)}|"
        _plot_power(above, w, entries[:, i, j], lines=curves.lines, number=number, label=label)
    if curves.record is not None:
        drawn = above.plot(w, curves.record, color=GREY, linewidth=0.8, zorder=1)
        drawn[0].set_label("record, smoothed")
    of = f"power of each line of {curves.symbol}" if curves.lines else f"density of {curves.symbol}"
    above.set_ylabel(of if len(there) <= MOST else f"{of},\n{MOST} of {len(there)} entries")
    shown = entries[:, [i for i, _ in pairs], [j for _, j in pairs]]
    _scale(above, shown, float(np.median(shown)) if shown.size else 0.0)  # no line without power
    style.legend_above(above)
    values = np.asarray(np.linalg.eigvalsh(curves.spectrum)[:, ::-1], dtype=float)
    # Eigenvalues below the last decade that is shown would have a label without a curve.
    seen = np.max(values, axis=0, initial=0.0) >= 10.0**-DECADES * values.max(initial=0.0)
    for number in np.flatnonzero(seen)[:MOST].tolist():
        label = f"λ{style.lowered(number + 1)}"
        _plot_power(below, w, values[:, number], lines=curves.lines, number=number, label=label)
    _plot_white(below, curves.white)
    _logarithmic(below, values)
    below.set_ylabel("eigenvalues")
    style.legend_above(below)
    style.frequency_axis(below, _room(w) if curves.lines else w, time_unit)


def _room(w: Array) -> Array:
    """Return the frequencies of lines with margins on both sides: a line on an axis is not seen."""
    shown = w[w > 0]
    return np.array([*w, shown.min() / _BESIDE, shown.max() * _BESIDE]) if shown.size else w


def draw_directions(page: Figure, curves: DirectionCurves, time_unit: str) -> None:
    """Draw the gains of the plant above; below, the input power along each of its input directions."""
    w = curves.frequency
    upper, lower = page.subplots(2, 1, sharex=True)
    for i, (gain, power) in enumerate(zip(curves.gain.T, curves.power.T, strict=True)):
        upper.plot(w, gain, color=PALETTE[i % MOST], label=f"σ{style.lowered(i + 1)}(G)")
        label = "v{0}* Φᵤ v{0}".format(style.lowered(i + 1))
        _plot_power(lower, w, power, lines=curves.lines, number=i, label=label)
    style.log_axes(upper, "y", "mask")
    upper.set_ylabel("gains of the plant")
    style.legend_above(upper)
    _plot_white(lower, curves.white)
    _logarithmic(lower, curves.power)
    lower.set_ylabel("input along them")
    style.frequency_axis(lower, w, time_unit)
    style.legend_above(lower)


def draw_optimality(page: Figure, curves: OptimalityCurves, time_unit: str) -> None:
    """Draw the relative worth of a unit of cost over frequency: one on the support, and never more."""
    axes = page.add_subplot()
    w, ratio, support = curves.frequency, curves.ratio, curves.support
    axes.plot(w, ratio, color=BLUE, linewidth=2.0, label="worth of a unit of cost")
    if curves.within is not None:
        label = "worth by the bound over all records"
        axes.plot(w, curves.within, color=GREY, linestyle=DASHED, linewidth=1.6, label=label)
    axes.axhline(1.0, color=BLACK, linewidth=1.0, label="the most that is allowed")
    if support.size:
        label = "where the optimum has its power"
        style.marked(axes, support, np.interp(support, w, ratio), color=ORANGE, label=label)
    top = max(1.0, float(ratio.max()), 0.0 if curves.within is None else float(curves.within.max()))
    axes.set_ylim(0.0, 1.08 * top)
    axes.set_ylabel("relative worth of excitation")
    style.frequency_axis(axes, w, time_unit)
    title = (
        "Accuracy per unit of cost is highest at the frequencies that the design excites: "
        "no other spectrum does better than the proved bound."
    )
    if curves.record_bound is not None:
        title += f" Bound over all records within the amplitude: {curves.record_bound:.6g}."
    style.title_above(page, title)
    style.legend_above(axes)


def _plot_power(axes: Axes, w: Array, values: Array, *, lines: bool, number: int, label: str) -> None:
    """Draw a power over frequency, the `number`th of its panel, as a curve or as stems of `lines`."""
    colour = PALETTE[number % MOST]
    if lines:  # coinciding points have different sizes
        axes.vlines(w, 0.0, values, color=colour, linewidth=1.0, alpha=0.6)
        axes.plot(w, values, "o", markersize=max(7.0 - 2.5 * number, 2.0), color=colour, label=label)
    else:
        dashes = DASHES[number % len(DASHES)]
        axes.plot(w, values, color=colour, linestyle=dashes, linewidth=1.8, label=label)


def _plot_white(axes: Axes, level: float | None, label: str = "white, same power") -> None:
    """Draw the level of white excitation, if it is known."""
    if level is not None:
        axes.axhline(level, color=GREY, linestyle=DASHED, label=label)


def _scale(axes: Axes, values: Array, usual: float) -> None:
    """Make the axis logarithmic where the peak is far above the `usual` value; else begin it at zero."""
    if float(values.max(initial=0.0)) > LOG_FROM * usual:
        _logarithmic(axes, values)
    else:
        axes.set_ylim(bottom=0.0)


def _logarithmic(axes: Axes, values: Array) -> None:
    """Make the axis logarithmic over the leading decades; zeros of a spectrum would stretch it endlessly."""
    peak = float(values.max(initial=0.0))
    if peak > 0.0:
        style.log_axes(axes, "y", "mask")
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, peak * 10.0**-DECADES), max(high, 2.0 * peak))
