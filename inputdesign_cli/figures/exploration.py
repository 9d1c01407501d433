"""response.png and structures.png: what a record tells without a structure, and which structure it is."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import BLUE, GREY, ORANGE, PALETTE, legend_above
from inputdesign_cli.runs.results import OrderCurves, ResponseCurves, ResponsePanel

_TWO = 1.96
_LEAST_SHOWN = -20.0


def draw_response(page: Figure, curves: ResponseCurves, time_unit: str) -> None:
    """|G| of the model with its 95 % band, before the points of the data; of one entry also its phase."""
    if len(curves.panels) > 1:
        draw_panels(page, curves.panels, _magnitude, time_unit, magnitude="magnitude")
        return
    (panel,) = curves.panels
    above, below = page.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    legend_above(above, _magnitude(above, panel))
    above.set_xscale("log")
    above.set_ylabel("magnitude")
    phase = np.degrees(np.unwrap(np.angle(panel.response)))
    below.plot(panel.frequency, phase, color=BLUE)
    known = np.isfinite(panel.measured) & (panel.measured_deviation < np.abs(panel.measured))
    model = np.interp(panel.measured_at, panel.frequency, phase)
    turn = np.degrees(np.angle(panel.measured)) - model
    nearest = model + (turn + 180.0) % 360.0 - 180.0
    below.plot(panel.measured_at[known], nearest[known], ".", color=GREY, markersize=3)
    below.set_ylabel("phase (degrees)")
    below.set_xlabel(rf"frequency $\omega$ (rad/{time_unit})")


def _magnitude(axes: Axes, panel: ResponsePanel) -> list[Artist]:
    axes.set_yscale("log")
    handles: list[Artist] = []
    size, points = np.abs(panel.response), np.abs(panel.measured)
    spread = _TWO * panel.measured_deviation
    with np.errstate(invalid="ignore"):
        below = np.minimum(spread, 0.9 * points)
    bars = axes.errorbar(
        panel.measured_at,
        points,
        yerr=np.vstack([below, spread]),
        fmt=".",
        color=GREY,
        markersize=3,
        linewidth=0.6,
        label="data alone, 95 %",
    )
    handles.append(bars[0])
    band = _TWO * panel.deviation
    axes.fill_between(
        panel.frequency, np.maximum(size - band, 1e-3 * size), size + band, color=BLUE, alpha=0.2, linewidth=0
    )
    handles += axes.plot(panel.frequency, size, color=BLUE, label="model, 95 %")
    top = float(np.nanmax(np.concatenate([size, points[np.isfinite(points)]])))
    axes.set_ylim(max(float(size[size > 0].min(initial=top)) / 10.0, 1e-6 * top), 3.0 * top)
    return handles


def draw_orders(page: Figure, curves: OrderCurves, time_unit: str) -> None:
    """The fit by simulation to data that were not used, over the number of parameters, family by family."""
    axes = page.subplots()
    handles: list[Artist] = []
    for color, (family, (sizes, fit)) in zip(PALETTE, curves.fits.items(), strict=False):
        shown = np.maximum(fit, _LEAST_SHOWN)
        handles += axes.plot(sizes, shown, "o", color=color, markersize=5, label=family)
    handles += axes.plot(
        *curves.chosen, "o", markersize=12, markerfacecolor="none", color=ORANGE, label="chosen"
    )
    axes.set_xlabel("parameters")
    name = "y" if curves.output is None else f"y{curves.output + 1}"
    axes.set_ylabel(f"fit of {name} on unseen data (%)")
    legend_above(axes, handles)
