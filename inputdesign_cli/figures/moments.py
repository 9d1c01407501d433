"""moments.png and error.png: the moments of the regressors, their lines, and the error that they buy."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    GREY,
    ORANGE,
    frequency_label,
    ink_on,
    legend_above,
    log_axes,
)
from inputdesign_cli.outcome.curves import ErrorCurves, MomentsCurves

_OPAQUE = 0.8
NUMBERED = 8  # rows up to which the entries are written into the cells


def draw_moments(page: Figure, curves: MomentsCurves, time_unit: str) -> None:
    """Draw R as a coloured matrix, its estimated block framed, and the power of each line of the input."""
    if curves.line_frequency is None or curves.line_power is None:
        _draw_matrix(page.add_subplot(), curves)
        return
    matrix, lines = page.subplots(1, 2, width_ratios=[1, 1])
    _draw_matrix(matrix, curves)
    lines.vlines(curves.line_frequency, 0.0, curves.line_power, color=BLUE, linewidth=1.8)
    lines.plot(curves.line_frequency, curves.line_power, "o", color=BLUE, markersize=5)
    lines.set_xlim(-0.03 * curves.nyquist, 1.03 * curves.nyquist)
    lines.set_ylim(0.0, 1.08 * float(curves.line_power.max()))
    lines.set_xlabel(frequency_label(time_unit))
    lines.set_ylabel("power of each line (mean square)")


def _draw_matrix(axes: Axes, curves: MomentsCurves) -> None:
    R, n, m = curves.R, len(curves.R), curves.estimated
    largest = float(np.abs(R).max())
    drawn = axes.imshow(R, cmap="RdBu", vmin=-largest, vmax=largest, alpha=_OPAQUE)
    axes.grid(False)
    axes.set_xticks(range(n), [str(i + 1) for i in range(n)])
    axes.set_yticks(range(n), [str(i + 1) for i in range(n)])
    axes.set_title(f"R, trace {np.trace(R):.5g}; framed: estimated", loc="left")
    inner, edge = m - 0.5, -0.5
    axes.plot(np.array([edge, inner, inner]), np.array([inner, inner, edge]), color=BLACK, linewidth=1.6)
    axes.set_xlim(-0.5, n - 0.5)
    axes.set_ylim(n - 0.5, -0.5)
    if n <= NUMBERED:
        for (i, j), value in np.ndenumerate(R):
            colour = ink_on(drawn, value, _OPAQUE)
            axes.text(j, i, f"{value:.3g}", ha="center", va="center", color=colour)


def draw_error(page: Figure, curves: ErrorCurves, time_unit: str) -> None:
    """Draw squared bias and variance stacked over energy, the error of white regressors, and the design."""
    axes = page.add_subplot()
    energy, bias = curves.energy, curves.bias_squared
    total = bias + curves.variance
    axes.fill_between(energy, 0.0, bias, color=ORANGE, alpha=0.55, linewidth=0, label="squared bias")
    axes.fill_between(energy, bias, total, color=BLUE, alpha=0.35, linewidth=0, label="variance")
    axes.plot(energy, total, color=BLUE, linewidth=2.0)
    axes.plot(energy, curves.white, color=GREY, linestyle=DASHED, label="white")
    if curves.target is not None:
        axes.axhline(curves.target, color=BLACK, linewidth=0.9, label="target")
    axes.plot(*curves.design, "o", color=BLUE, markersize=7, label="design")
    log_axes(axes, "x")
    axes.set_xlim(energy[0], energy[-1])
    axes.set_ylim(0.0, 3.0 * curves.design[1])
    axes.set_xlabel("energy, trace R")
    axes.set_ylabel("mean-squared error")
    legend_above(axes)
