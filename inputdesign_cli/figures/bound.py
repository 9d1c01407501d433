"""bound.png: the model error that the design allows, against what the target admits."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, DOTTED, GREEN, GREY, ORANGE, log_axes, marked
from inputdesign_cli.runs.curves import BoundCurves, BoundPanel
from inputdesign_cli.runs.results import Array

_BELOW = 0.3  # of the smallest error, what is shown


def draw_bound(page: Figure, curves: BoundCurves, time_unit: str) -> None:
    """|G|, r_u, r_adm and white excitation's r_u over frequency, with the active frequencies marked."""
    draw_panels(page, curves.panels, _plot, time_unit, magnitude="magnitude")


def _plot(axes: Axes, curves: BoundPanel) -> list[Artist]:
    """The curves of one entry on `axes`; the handles of their legend."""
    w = curves.frequency
    log_axes(axes, "y")
    handles: list[Artist] = []
    handles += axes.plot(w, _positive(curves.G_abs), color=BLACK, linewidth=1.2, label="|G|")
    if curves.r_adm is not None:
        r_adm = _positive(curves.r_adm)
        handles += axes.plot(w, r_adm, color=ORANGE, linestyle=DASHED, label="r_adm")
    handles += axes.plot(w, _positive(curves.r_u), color=BLUE, linewidth=2.0, label=f"r_u, {curves.label}")
    if curves.r_u_record is not None:
        record = _positive(curves.r_u_record)
        handles += axes.plot(w, record, color=GREEN, linewidth=1.1, label="r_u, record")
    if curves.r_u_white is not None:
        white = _positive(curves.r_u_white)
        handles += axes.plot(w, white, color=GREY, linestyle=DOTTED, label="r_u, white")
    if curves.active.size:
        height = np.exp(np.interp(curves.active, w, np.log(curves.r_u)))
        handles += marked(axes, curves.active, height, color=BLUE, label="active")
    # A zero of G is no reason to show decades of nothing.
    errors = [x for x in (curves.r_u, curves.r_adm, curves.r_u_record, curves.r_u_white) if x is not None]
    least = min(float(np.min(x[x > 0.0], initial=np.inf)) for x in errors)
    low, high = axes.get_ylim()
    axes.set_ylim(max(low, _BELOW * least), high)
    if curves.r_adm is not None:
        low, high = axes.get_ylim()
        axes.fill_between(w, _positive(curves.r_adm), high, color=ORANGE, alpha=0.07, linewidth=0)
        axes.set_ylim(low, high)
    return handles


def _positive(values: Array) -> Array:
    """`values` with gaps where a logarithmic axis has no place for them (an r_adm below zero, say)."""
    return np.where(values > 0, values, np.nan)
