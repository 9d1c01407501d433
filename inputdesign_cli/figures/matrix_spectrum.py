"""spectrum.png and directions.png of several inputs: eigenvalues, entries, and where the plant is weak."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from inputdesign_cli.figures.spectrum import DECADES, LOG_FROM
from inputdesign_cli.figures.style import GREY, PALETTE, figure, frequency_axis, legend_above
from inputdesign_cli.runs.results import Array, DirectionCurves, MatrixSpectrumCurves

# Entries of a nearly singular spectrum lie on each other: the dashes let the lower ones show through.
DASHES: tuple[Any, ...] = ("solid", (0, (4, 4)), (4, (4, 4)))
WHITE = (0, (5, 2))
MARGIN = 0.02  # beside the outermost lines, of the width between them
MOST = 6  # curves that stay apart in one panel


def draw_matrix_spectrum(curves: MatrixSpectrumCurves, path: Path, time_unit: str) -> None:
    """Moduli of the entries above, eigenvalues below: where the power is, and in how many directions."""
    r = curves.spectrum.shape[1]
    entries = np.asarray(np.abs(curves.spectrum), dtype=float)
    pairs = [(i, i) for i in range(r)] + [(i, j) for i in range(r) for j in range(i + 1, r)]
    with figure(path) as page:
        above, below = page.subplots(2, 1, sharex=True, height_ratios=[3, 2])
        handles: list[Any] = []
        for number, (i, j) in enumerate(pairs[:MOST]):
            label = rf"$|\Phi_{{{i + 1}{j + 1}}}|$"
            handles += _curve(above, curves, entries[:, i, j], number, label)
        if curves.record is not None:
            drawn = above.plot(curves.frequency, curves.record, color=GREY, linewidth=0.8, zorder=1)
            drawn[0].set_label("record, smoothed")
            handles += drawn[:1]
        of = f"power of each line of ${curves.symbol}$"
        above.set_ylabel(of if curves.lines else rf"density of ${curves.symbol}$")
        _linear_if_flat(above, entries[:, [i for i, _ in pairs], [j for _, j in pairs]])
        legend_above(above, handles)
        values = np.asarray(np.linalg.eigvalsh(curves.spectrum)[:, ::-1], dtype=float)
        handles = []
        for number in range(min(r, MOST)):
            handles += _curve(below, curves, values[:, number], number, rf"$\lambda_{{{number + 1}}}$")
        if curves.white is not None:
            handles.append(_white(below, curves.white))
        _logarithmic(below, values)
        below.set_ylabel("eigenvalues")
        legend_above(below, handles)
        _frequencies(below, curves, time_unit)


def draw_directions(curves: DirectionCurves, path: Path, time_unit: str) -> None:
    """The gains of the plant above; below, the power of the input along each of its input directions."""
    with figure(path) as page:
        upper, lower = page.subplots(2, 1, sharex=True)
        n = curves.gain.shape[1]
        handles = []
        for i in range(n):
            label = rf"$\sigma_{i + 1}(G)$"
            handles += upper.plot(curves.frequency, curves.gain[:, i], color=PALETTE[i % MOST], label=label)
        upper.set_yscale("log", nonpositive="mask")
        upper.set_ylabel("gains of the plant")
        legend_above(upper, handles)
        handles = []
        for i in range(n):
            label = rf"$v_{i + 1}^* \Phi_u v_{i + 1}$"
            handles += _curve(lower, curves, curves.power[:, i], i, label)
        if curves.white is not None:
            handles.append(_white(lower, curves.white))
        _logarithmic(lower, curves.power)
        lower.set_ylabel("input along them")
        frequency_axis(lower, curves.frequency, time_unit)
        legend_above(lower, handles)


def _curve(
    axes: Axes, curves: MatrixSpectrumCurves | DirectionCurves, values: Array, number: int, label: str
) -> list[Any]:
    w, colour = curves.frequency, PALETTE[number % MOST]
    if not curves.lines:
        dashes = DASHES[number % len(DASHES)]
        return axes.plot(w, values, color=colour, linestyle=dashes, linewidth=1.8, label=label)
    axes.vlines(w, 0.0, values, color=colour, linewidth=1.0, alpha=0.6)
    return axes.plot(w, values, linestyle="none", marker="o", markersize=4, color=colour, label=label)


def _frequencies(axes: Axes, curves: MatrixSpectrumCurves, time_unit: str) -> None:
    w = curves.frequency
    if curves.logarithmic:
        frequency_axis(axes, w, time_unit)
        return
    lo, hi = float(w.min()), float(w.max()) if w.max() > w.min() else float(w.min()) + 1.0
    margin = MARGIN * (hi - lo) if curves.lines else 0.0
    axes.set_xlim(lo - margin, hi + margin)
    axes.set_xlabel(rf"frequency $\omega$ (rad/{time_unit})")


def _white(axes: Axes, level: float) -> Any:
    return axes.axhline(level, color=GREY, linestyle=WHITE, label="white, same power")


def _linear_if_flat(axes: Axes, values: Array) -> None:
    """A linear axis, or a logarithmic one where a linear one would show nothing but its peaks."""
    if float(values.max(initial=0.0)) > LOG_FROM * float(np.median(values)):
        _logarithmic(axes, values)
    else:
        axes.set_ylim(bottom=0.0)


def _logarithmic(axes: Axes, values: Array) -> None:
    """A logarithmic axis over the leading decades: zeros of a spectrum would stretch it without end."""
    peak = float(values.max(initial=0.0))
    if peak > 0.0:
        axes.set_yscale("log", nonpositive="mask")
        low, high = axes.get_ylim()
        axes.set_ylim(max(low, peak * 10.0**-DECADES), max(high, 2.0 * peak))
