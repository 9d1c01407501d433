"""frequency_response.png: |G| from data alone, beside that of a model."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import BLACK, BLUE
from inputdesign_cli.runs.results import ResponseCurves, ResponsePanel


def draw_response(page: Figure, curves: ResponseCurves, time_unit: str) -> None:
    """The magnitudes over frequency, and between which two the true one is with 95 %."""
    draw_panels(page, curves.panels, _plot, time_unit, magnitude="magnitude")


def _plot(axes: Axes, curves: ResponsePanel) -> list[Artist]:
    w, size = curves.frequency, curves.G_abs
    axes.set_yscale("log")
    handles: list[Artist] = []
    handles += axes.plot(w, size, ".", color=BLUE, markersize=4, label="$|G|$, data alone")
    handles += axes.plot(w, curves.model_abs, color=BLACK, linewidth=1.2, label="$|G|$, model")
    least = 0.1 * min(float(size.min()), float(curves.model_abs.min()))
    below = np.maximum(size - curves.radius, least)
    axes.fill_between(w, below, size + curves.radius, color=BLUE, alpha=0.15, linewidth=0)
    return handles
