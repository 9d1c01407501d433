"""loss.png: what the controller lost over the runs of a Monte Carlo study."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from inputdesign_cli.figures.style import BLUE, GREEN, GREY, ORANGE, legend_above
from inputdesign_cli.runs.results import LossCurves

COLOURS = (BLUE, ORANGE, GREEN, GREY)
BINS = 40
SHADE = 0.45
# The few runs of the tail would squeeze the rest into a corner.
SHOWN = 0.998


def draw_loss(page: Figure, curves: LossCurves, time_unit: str) -> None:
    """A histogram for each input on common bins, with its mean as a vertical line."""
    axes = page.add_subplot()
    top = max(float(np.quantile(loss, SHOWN)) for loss in curves.losses.values())
    bins = np.linspace(0.0, top, BINS + 1)
    handles = []
    for index, (name, loss) in enumerate(curves.losses.items()):
        colour = COLOURS[index % len(COLOURS)]
        weights = np.full(loss.size, 100.0 / loss.size)
        label = f"{name}: mean {loss.mean():.4g}, sd {loss.std(ddof=1):.4g}"
        axes.hist(loss, bins=bins.tolist(), weights=weights, color=colour, alpha=SHADE)
        handles.append(Patch(color=colour, alpha=SHADE, label=label))
        axes.axvline(float(loss.mean()), color=colour, linewidth=1.8)
        if name in curves.theory:
            axes.axvline(curves.theory[name], color=colour, linewidth=1.4, linestyle=(0, (4, 3)))
    axes.set_xlabel(r"loss of a run, $\sqrt{\Sigma_t |y - y_0|^2}$ (solid: mean of the runs, dashed: theory)")
    axes.set_ylabel("share of the runs (%)")
    axes.set_xlim(0.0, top)
    legend_above(axes, handles)
