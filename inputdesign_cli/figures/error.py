"""error.png: how squared bias and variance make up the mean-squared error as the energy changes."""

from __future__ import annotations

from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, GREY, ORANGE, legend_above
from inputdesign_cli.runs.results import ErrorCurves


def draw_error(page: Figure, curves: ErrorCurves, time_unit: str) -> None:
    """The two parts stacked over energy, white regressors beside them, and the design."""
    axes = page.add_subplot()
    energy, bias = curves.energy, curves.bias_squared
    total = bias + curves.variance
    parts = [
        axes.fill_between(energy, 0.0, bias, color=ORANGE, alpha=0.55, linewidth=0, label="squared bias"),
        axes.fill_between(energy, bias, total, color=BLUE, alpha=0.35, linewidth=0, label="variance"),
    ]
    axes.plot(energy, total, color=BLUE, linewidth=2.0)
    (white,) = axes.plot(energy, curves.white, color=GREY, linestyle=DASHED, label="white")
    handles = [*parts, white]
    if curves.target is not None:
        handles.append(axes.axhline(curves.target, color=BLACK, linewidth=0.9, label="target"))
    (mark,) = axes.plot(*curves.design, "o", color=BLUE, markersize=7, label="design")
    axes.set_xscale("log")
    axes.set_xlim(energy[0], energy[-1])
    axes.set_ylim(0.0, 3.0 * curves.design[1])
    axes.set_xlabel("energy, trace R")
    axes.set_ylabel("mean-squared error")
    legend_above(axes, [*handles, mark])
