"""spectrum.png: where in frequency the design puts its power."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from inputdesign_cli.figures.style import BLUE, GREEN, GREY, ORANGE, figure, frequency_axis, legend_above
from inputdesign_cli.runs.results import Array, SpectrumCurves

LOG_FROM = 100.0  # a density whose peak is further above the white level reads better on a logarithmic axis
DECADES = 5.0  # shown below the peak: the zeros of a spectrum would stretch the axis without end


def draw_spectrum(curves: SpectrumCurves, path: Path, time_unit: str) -> None:
    """The density over frequency with the level of the white baseline; sinusoids as stems of their power."""
    with figure(path) as page:
        axes = page.add_subplot()
        frequencies: list[Array] = [curves.frequency]
        handles: list[Artist] = []
        if curves.density is not None:
            label = rf"$\Phi_{{{curves.symbol}}}$, design"
            handles += axes.plot(curves.frequency, curves.density, color=BLUE, linewidth=2.0, label=label)
            if curves.record is not None:
                label = "record, smoothed"
                handles += axes.plot(
                    curves.frequency, curves.record, color=GREEN, linewidth=1.0, alpha=0.8, label=label
                )
            if curves.white is not None:
                white = rf"$\Phi_{{{curves.symbol}}}$, white"
                handles.append(axes.axhline(curves.white, color=GREY, linestyle=(0, (5, 2)), label=white))
            axes.set_ylabel(rf"spectral density $\Phi_{{{curves.symbol}}}(\omega)$")
            _scale_density(axes, curves.density, curves.white)
        if curves.line_frequency is not None and curves.line_power is not None:
            stems = axes
            if curves.density is not None:
                stems = axes.twinx()
                stems.grid(False)
                stems.spines["right"].set_visible(True)
            handles.append(_draw_lines(stems, curves.line_frequency, curves.line_power, curves))
            frequencies.append(curves.line_frequency)
        frequency_axis(axes, np.concatenate(frequencies), time_unit)
        legend_above(axes, handles)


def _scale_density(axes: Axes, density: Array, white: float | None) -> None:
    peak = float(density.max())
    if peak > LOG_FROM * (white if white else float(np.median(density))):
        axes.set_yscale("log", nonpositive="mask")
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, peak * 10.0**-DECADES), high)
    else:
        axes.set_ylim(bottom=0.0)


def _draw_lines(axes: Axes, frequency: Array, power: Array, curves: SpectrumCurves) -> LineCollection:
    few = frequency.size <= 60
    total = f"sinusoids, total power {power.sum():.4g}"
    if curves.density is None and curves.white is not None:
        total += f" (white: {curves.white:.4g})"
    stems = axes.vlines(frequency, 0.0, power, color=ORANGE, linewidth=1.8 if few else 0.8, label=total)
    axes.plot(frequency, power, linestyle="none", marker="o", markersize=5 if few else 2.5, color=ORANGE)
    axes.set_ylim(0.0, 1.08 * float(power.max()))
    axes.set_ylabel(rf"power of each sinusoid of ${curves.symbol}$ (mean square)")
    return stems
