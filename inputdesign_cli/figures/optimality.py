"""optimality.png: the certificate of the design, readable by eye."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLACK, BLUE, ORANGE, frequency_axis, legend_above, marked
from inputdesign_cli.runs.results import OptimalityCurves


def draw_optimality(page: Figure, curves: OptimalityCurves, time_unit: str) -> None:
    """What a unit of cost buys at each frequency, relative to the best: one on the support, never more."""
    axes = page.add_subplot()
    (ratio,) = axes.plot(
        curves.frequency, curves.ratio, color=BLUE, linewidth=2.0, label="worth of a unit of cost"
    )
    handles = [ratio, axes.axhline(1.0, color=BLACK, linewidth=1.0, label="optimal: nowhere above one")]
    if curves.support.size:
        height = np.interp(curves.support, curves.frequency, curves.ratio)
        handles += marked(axes, curves.support, height, color=ORANGE, label="power of the optimum")
    axes.set_ylim(0.0, 1.08 * max(1.0, float(curves.ratio.max())))
    axes.set_ylabel("relative worth of excitation")
    frequency_axis(axes, curves.frequency, time_unit)
    legend_above(axes, handles)
