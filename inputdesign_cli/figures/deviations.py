"""deviations.png: standard deviations of a frequency response, line by line, against what is admitted."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import BLACK, BLUE, GREEN, log_axes, plot_admitted
from inputdesign_cli.outcome.curves import DeviationCurves, DeviationPanel


def draw_deviations(page: Figure, curves: DeviationCurves, time_unit: str) -> None:
    """|G|, the standard deviations and r_adm at every line."""
    draw_panels(page, curves.panels, _plot, time_unit, magnitude="magnitude")


def _plot(axes: Axes, panel: DeviationPanel) -> None:
    w = panel.frequency
    log_axes(axes, "y")
    axes.plot(w, panel.G_abs, ".-", color=BLACK, linewidth=1.0, markersize=4, label="|G|")
    axes.plot(w, panel.deviation, "o", color=BLUE, markersize=5, label="standard deviation")
    if panel.found is not None:
        axes.plot(w, panel.found, "x", color=GREEN, markersize=6, label=panel.label)
    plot_admitted(axes, w, panel.r_adm)
