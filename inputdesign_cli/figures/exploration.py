"""structures.png: which structure explains data that were not used."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from inputdesign_cli.figures.style import ORANGE, PALETTE, legend_over_all
from inputdesign_cli.runs.curves import OrderCurves

_LEAST_SHOWN = -20.0


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
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    name = "y" if curves.output is None else f"y{curves.output + 1}"
    axes.set_ylabel(f"fit of {name} on unseen data (%)")
    legend_over_all(page, handles)
