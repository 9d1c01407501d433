"""frequency_response.png: G from data alone, beside that of a model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import BLACK, BLUE, frequency_axis, legend_above, log_axes, lowered, stroke
from inputdesign_cli.outcome.curves import ResponseCurves, ResponsePanel


def draw_response(page: Figure, curves: ResponseCurves, time_unit: str) -> None:
    """The magnitudes, and between which two the true one is with 95 %; below them the phases."""
    if len(curves.panels) > 1:
        draw_panels(page, curves.panels, _magnitude, time_unit, magnitude="magnitude", below=_phases)
        return
    (panel,) = curves.panels
    above, below = page.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    _magnitude(above, panel)
    legend_above(above)
    above.set_ylabel("magnitude")
    _phase(below, panel, BLUE, BLACK)
    below.set_ylabel("phase (degrees)")
    frequency_axis(below, panel.frequency, time_unit)


def _magnitude(axes: Axes, panel: ResponsePanel) -> None:
    w, size, modelled = panel.frequency, np.abs(panel.G), np.abs(panel.model)
    log_axes(axes, "y")
    axes.plot(w, size, ".", color=BLUE, markersize=4, label="|G|, data alone")
    axes.plot(w, modelled, color=BLACK, linewidth=1.2, label="|G|, model")
    least = 0.1 * min(float(size.min()), float(modelled.min()))
    below = np.maximum(size - panel.radius, least)
    axes.fill_between(w, below, size + panel.radius, color=BLUE, alpha=0.15, linewidth=0)


def _phases(axes: Axes, panels: Sequence[ResponsePanel]) -> None:
    """Draw the phases of all entries; a negative gain begins half a turn away from a positive one."""
    for number, panel in enumerate(panels):
        color, dashes = stroke(number)
        row, column = panel.entry or (0, 0)
        (line,) = _phase(axes, panel, color, color)
        line.set(linestyle=dashes, label=f"G{lowered(row + 1, column + 1)}")
    axes.set_ylabel("phase (degrees)")


def _phase(axes: Axes, panel: ResponsePanel, of_data: str, of_model: str) -> list[Line2D]:
    """Draw the phase of the model without jumps, and of the data, if known, on the nearest turn."""
    model = np.degrees(np.unwrap(np.angle(panel.model)))
    known = panel.radius < np.abs(panel.G)
    turn = np.degrees(np.angle(panel.G)) - model
    nearest = model + (turn + 180.0) % 360.0 - 180.0
    axes.plot(panel.frequency[known], nearest[known], ".", color=of_data, markersize=4)
    return axes.plot(panel.frequency, model, color=of_model, linewidth=1.2)
