"""structures.png: which structure explains data that were not used."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from inputdesign_cli.figures.style import BLACK, legend_over_all, point
from inputdesign_cli.outcome.curves import OrderCurves

_LEAST_SHOWN = -20.0


def draw_orders(page: Figure, curves: OrderCurves, time_unit: str) -> None:
    """The fit by simulation to data that were not used, over the number of parameters, family by family."""
    axes = page.subplots()
    least = 0.0
    for number, (family, (sizes, fit)) in enumerate(curves.fits.items()):
        color, marker = point(number)
        shown = np.maximum(fit, _LEAST_SHOWN)
        least = min(least, float(np.min(fit, initial=0.0)))
        axes.plot(sizes, shown, marker, color=color, markersize=5, alpha=0.8, label=family)
    label = f"chosen: {curves.family}"
    axes.plot(*curves.chosen, "o", markersize=12, markerfacecolor="none", color=BLACK, label=label)
    axes.set_xlabel("parameters")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    name = "y" if curves.output is None else f"y{curves.output + 1}"
    worse = f"; below {_LEAST_SHOWN:g}: there" if least < _LEAST_SHOWN else ""
    which = "unseen data" if curves.unseen else "the data that estimate"
    axes.set_ylabel(f"fit of {name} on {which} (%{worse})")
    legend_over_all(page)
