"""fan.png: how near every plant that the true one might be comes to missing what is asked."""

from __future__ import annotations

from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    BLACK,
    DASHED,
    GREY,
    ORANGE,
    OTHERS,
    frequency_axis,
    legend_above,
    plain_decades,
)
from inputdesign_cli.outcome.curves import FanCurves

# More lines than these are one grey area.
_MOST_LINES = 200
MOST_NAMED = 5
_LEAST = 1e-3


def draw_fan(page: Figure, curves: FanCurves, time_unit: str) -> None:
    """Draw a line for every plant, the binding plants in colour; no ratio may exceed one."""
    axes = page.add_subplot()
    plain_decades(axes, "y")
    w = curves.frequency
    rows = curves.ratios[:_MOST_LINES]
    width = 0.5 if len(rows) > 20 else 0.8
    axes.plot(w, rows.T, color=GREY, linewidth=width, alpha=0.45)
    if len(rows):
        largest = f"largest of {len(curves.ratios)} plants"
        axes.plot(w, curves.ratios.max(axis=0), color=GREY, linewidth=width, label=largest)
    axes.plot(w, curves.nominal, color=BLACK, linewidth=1.4, label="plant of the spec")
    named = list(curves.active.items())[:MOST_NAMED]
    for (name, ratio), color in zip(named, OTHERS, strict=False):
        axes.plot(w, ratio, color=color, linewidth=1.4, label=name)
    shown = curves.nominal if not len(rows) else rows
    top = 1.3 * max(float(shown.max()), 1.0)
    axes.axhline(1.0, color=ORANGE, linestyle=DASHED, label="limit")
    axes.axhspan(1.0, top, color=ORANGE, alpha=0.07, linewidth=0)
    axes.set_ylim(max(float(shown.min()) * 0.8, _LEAST * float(shown.max())), top)
    frequency_axis(axes, w, time_unit)
    axes.set_ylabel("r_u / r_adm")
    legend_above(axes)
