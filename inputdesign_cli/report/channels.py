"""spectrum.png and bound.png of several channels: entries and eigenvalues, a panel an entry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from inputdesign_cli.outcome import Array, ChannelBoundCurves, ChannelSpectrumCurves
from inputdesign_cli.report.bound import plot_bound
from inputdesign_cli.report.spectrum import DECADES, LOG_FROM
from inputdesign_cli.report.style import BLUE, GREEN, GREY, ORANGE, figure, legend_above

PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#56B4E9", "#E69F00")
STYLES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (5, 1, 1, 1)))
MARGIN = 0.02  # beside the outermost lines, of the width between them
MOST = 6  # entries that stay apart in one panel


def draw_channel_spectrum(curves: ChannelSpectrumCurves, path: Path, time_unit: str) -> None:
    """Moduli of the entries above, eigenvalues below: where the power is, and in how many directions."""
    with figure(path) as page:
        above, below = page.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        w = curves.frequency
        handles: list[Artist] = []
        for number, (name, values) in enumerate(list(curves.moduli.items())[:MOST]):
            label = rf"$|\Phi_{{{name}}}|$"
            handles += _curve(above, w, values, PALETTE[number], STYLES[number % 4], label, curves.lines)
        if curves.record:
            drawn = [
                above.plot(w, values, color=GREY, linewidth=0.8, zorder=1)
                for values in curves.record.values()
            ]
            drawn[0][0].set_label("record, smoothed")
            handles += drawn[0]
        what = "power of each line" if curves.lines else rf"density of ${curves.symbol}$"
        above.set_ylabel(what)
        _scale(above, np.concatenate(list(curves.moduli.values())))
        legend_above(above, handles)
        shades: list[Artist] = []
        for number, values in enumerate(curves.eigenvalues.T[::-1][:MOST]):
            label = rf"$\lambda_{{{number + 1}}}$"
            shades += _curve(below, w, values, PALETTE[number], STYLES[number % 4], label, curves.lines)
        peak = float(curves.eigenvalues.max(initial=0.0))
        if peak > 0:
            below.set_yscale("log")
            below.set_ylim(peak * 10.0**-DECADES, 2.0 * peak)
        below.set_ylabel("eigenvalues")
        legend_above(below, shades)
        below.set_xlabel(rf"frequency $\omega$ (rad/{time_unit})")
        lo, hi = float(w.min()), float(w.max()) if w.max() > w.min() else float(w.min()) + 1.0
        margin = MARGIN * (hi - lo) if curves.lines else 0.0
        below.set_xlim(lo - margin, hi + margin)


def _scale(axes: Axes, values: Array) -> None:
    """A linear axis, or a logarithmic one where a linear one would show nothing but its peaks."""
    peak = float(values.max(initial=0.0))
    if peak > LOG_FROM * float(np.median(values)):
        axes.set_yscale("log")
        axes.set_ylim(peak * 10.0**-DECADES, 2.0 * peak)
    else:
        axes.set_ylim(bottom=0.0)


def _curve(
    axes: Axes, w: Array, values: Array, color: str, style: object, label: str, lines: bool
) -> list[Artist]:
    if lines:
        axes.vlines(w, 0.0, values, color=color, linewidth=1.0, alpha=0.6)
        return list(
            axes.plot(w, values, linestyle="none", marker="o", markersize=4, color=color, label=label)
        )
    return list(axes.plot(w, values, color=color, linestyle=style, linewidth=1.8, label=label))


def draw_channel_bounds(curves: ChannelBoundCurves, path: Path, time_unit: str) -> None:
    """A panel for every entry of G, outputs as rows."""
    places = {name: tuple(int(part) for part in re.findall(r"\d+", name)) for name in curves.entries}
    rows, columns = (max(place[axis] for place in places.values()) for axis in (0, 1))
    with figure(path) as page:
        grid: Any = page.subplots(rows, columns, sharex=True, squeeze=False)
        handles: list[Artist] = []
        for name, entry in curves.entries.items():
            i, j = places[name]
            axes = grid[i - 1][j - 1]
            found = plot_bound(axes, entry)
            handles = max(handles, found, key=len)
            axes.set_xscale("log")
            axes.set_xlim(float(entry.frequency.min()), float(entry.frequency.max()))
            axes.set_title(f"$G_{{{i}{j}}}$", loc="left", color=GREY)
        drawn = {(i - 1, j - 1) for i, j in places.values()}
        for i, j in np.ndindex(rows, columns):
            if (i, j) not in drawn:
                grid[i][j].set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel(rf"$\omega$ (rad/{time_unit})")
        page.legend(handles=handles, loc="outside upper left", ncols=len(handles))
