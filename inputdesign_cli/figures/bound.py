"""bound.png: the model error that the design allows, against what the target admits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.typing import LineStyleType

from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    DOTTED,
    GREEN,
    GREY,
    ORANGE,
    OTHERS,
    legend_above,
    limiting_label,
    log_axes,
    marked,
    plain_decades,
    plot_admitted,
    positive,
    stroke,
)
from inputdesign_cli.outcome.curves import BoundCurves, BoundPanel
from inputdesign_cli.outcome.results import Array

# Ratios beyond this many times the limit, or the design, run out of the linear panel.
_HIGHEST = 4.0
# Ratios that all stay below this share of the limit are flat on a linear axis: they are drawn over decades.
_FAR_BELOW = 0.25
# A gain below this many times the least error is drawn there.
_FAR = 1e-2


def draw_bound(page: Figure, curves: BoundCurves, time_unit: str) -> None:
    """r_u of design, record and white excitation against r_adm, and their ratios on a linear axis.

    Where nothing is asked of the error, against |G|.
    """
    stated = [panel for panel in curves.panels if panel.r_adm is not None]
    title = "Model error r_u against the admitted error r_adm" if stated else "Model error r_u beside |G|"
    title += ", at the plant of the spec" if curves.of_several else ""
    below = _plot_ratios if stated else None
    draw_panels(page, curves.panels, _plot, time_unit, magnitude="error of G", title=title, below=below)


def _plot(axes: Axes, curves: BoundPanel) -> None:
    """The curves of one entry on `axes`, in the range of the errors."""
    w = curves.frequency
    log_axes(axes, "y")
    for error in _drawn(curves):
        error.plot(axes, w, positive(error.values), f"r_u, {error.name}")
    if curves.r_adm is not None:
        plot_admitted(axes, w, curves.r_adm)
    else:
        least = _FAR * min(float(np.nanmin(positive(error.values))) for error in _drawn(curves))
        gain = np.maximum(curves.G_abs, least)  # one that vanishes would stretch the axis without end
        axes.plot(w, gain, color=BLACK, linewidth=1.2, label="|G|")
    if curves.active.size:
        height = np.exp(np.interp(curves.active, w, np.log(curves.r_u)))
        marked(axes, curves.active, height, color=BLUE, label=limiting_label(curves.active.size))


@dataclass(frozen=True)
class _Error:
    """One r_u (n,) or its ratio, and how it is drawn wherever it is."""

    name: str
    values: Array
    color: str
    width: float = 1.6
    style: LineStyleType = "solid"

    def plot(self, axes: Axes, w: Array, values: Array, label: str) -> list[Line2D]:
        return axes.plot(w, values, color=self.color, linewidth=self.width, linestyle=self.style, label=label)


def _drawn(curves: BoundPanel) -> list[_Error]:
    """What r_u there is: the widest first, so that the others show on it."""
    needed, equal = curves.white_labels
    found = [_Error(curves.label, curves.r_u, BLUE, 2.4)]
    if curves.r_u_record is not None:
        found.append(_Error("record", curves.r_u_record, GREEN, 1.2, DASHED))
    if curves.r_u_equal is not None:
        found.append(_Error(equal, curves.r_u_equal, GREY, 1.4))
    if curves.r_u_white is not None:
        found.append(_Error(needed, curves.r_u_white, GREY, 1.6, DOTTED))
    return found


def _plot_ratios(axes: Axes, panels: Sequence[BoundPanel]) -> None:
    """r_u / r_adm, with the largest in the legend: of one entry all curves, of several that of each."""
    handles: list[Artist] = []
    tops, drawn_ratios = [1.0], list[Array]()
    for number, curves in enumerate(panels):
        if curves.r_adm is None:
            continue
        drawn = _drawn(curves)
        if len(panels) > 1:
            at = "" if curves.entry is None else f"G{curves.entry[0] + 1}{curves.entry[1] + 1}"
            color, style = stroke(number, OTHERS)
            drawn = [_Error(at, curves.r_u, color, style=style)]
        for place, error in enumerate(drawn):
            ratio = error.values / positive(curves.r_adm)
            top = float(np.nanmax(ratio, initial=0.0))
            lines = error.plot(axes, curves.frequency, ratio, f"{error.name}: up to {top:.3g}")
            # White excitation that meets the same reaches the same: no more than its name is to be said.
            handles += lines if error.style != DOTTED or curves.r_u_equal is None else []
            tops.append(top if not place else min(top, _HIGHEST * max(tops)))
            drawn_ratios.append(ratio[ratio > 0])
        if len(panels) == 1 and curves.active.size:
            height = np.interp(curves.active, curves.frequency, curves.r_u / positive(curves.r_adm))
            marked(axes, curves.active, height, color=BLUE, label="")
    handles.append(axes.axhline(1.0, color=ORANGE, linestyle=DASHED, label="limit"))
    axes.axhspan(1.0, 1.12 * max(tops) + 1.0, color=ORANGE, alpha=0.07, linewidth=0)
    axes.set_ylim(0.0, 1.12 * max(tops))
    ratios = np.concatenate(drawn_ratios or [np.ones(1)])
    if ratios.size and ratios.max() < _FAR_BELOW:
        plain_decades(axes, "y")
        axes.set_ylim(max(0.8 * float(ratios.min()), _FAR * float(ratios.max())), 1.3)
    axes.set_ylabel("r_u / r_adm")
    legend_above(axes, handles)
