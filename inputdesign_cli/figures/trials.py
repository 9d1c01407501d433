"""cloud_*.png, errors_*.png and loss.png: what many runs of an experiment gave, against theory."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inputdesign_cli.figures.ellipses import boundary
from inputdesign_cli.figures.panels import draw_panels
from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DOTTED,
    GREEN,
    GREY,
    ORANGE,
    legend_above,
    legend_over_all,
    log_axes,
    page_of_pairs,
    plot_admitted,
    positive,
)
from inputdesign_cli.outcome.curves import CloudCurves, ErrorBandCurves, ErrorBandPanel, LossCurves

COLUMNS = 2
COLOURS = (BLUE, ORANGE, GREEN, GREY)
BINS = 40
SHADE = 0.45
# The few runs of the tail would squeeze the rest into a corner.
SHOWN = 0.998


def draw_cloud(page: Figure, curves: CloudCurves, time_unit: str) -> None:
    """One panel a pair of parameters: an estimate a dot, with the ellipse that theory predicts."""
    grid = page_of_pairs(page, len(curves.pairs), COLUMNS)
    for axes, (i, j) in zip(grid, curves.pairs, strict=True):
        pair = np.array([i, j])
        axes.plot(*curves.theta[:, pair].T, ".", color=BLUE, markersize=2.5, alpha=0.5, rasterized=True)
        outline = boundary(curves.centre[pair], curves.covariance[np.ix_(pair, pair)], curves.probability)
        axes.plot(*outline, color=ORANGE, linewidth=1.8)
        axes.plot(*curves.centre[pair], "+", color=BLACK, markersize=9, markeredgewidth=1.6)
        axes.set_xlabel(curves.names[i])
        axes.set_ylabel(curves.names[j])
    share = f"{100 * curves.probability:g} % ellipse of theory"
    handles = [
        Line2D([], [], color=BLUE, marker=".", linestyle="none", label=f"{len(curves.theta)} estimates"),
        Line2D([], [], color=ORANGE, label=share),
        Line2D([], [], color=BLACK, marker="+", linestyle="none", label="truth"),
    ]
    legend_over_all(page, handles)


def draw_error_bands(page: Figure, curves: ErrorBandCurves, time_unit: str) -> None:
    """The median and the central band of |G_hat - G_0| over frequency, with r_u and r_adm."""
    plot = partial(_bands, runs=curves.runs)
    draw_panels(
        page,
        curves.panels,
        plot,
        time_unit,
        magnitude="|Ĝ − G₀|",
        title=f"Errors of the models: {curves.name}",
    )


def _bands(axes: Axes, curves: ErrorBandPanel, *, runs: int) -> None:
    """Draw the curves of one entry."""
    w, levels = curves.frequency, sorted(curves.quantiles)
    low, high = levels[0], levels[-1]
    log_axes(axes, "y")
    label = f"{100 * low:g} to {100 * high:g} % of {runs} runs"
    axes.fill_between(
        w, curves.quantiles[low], curves.quantiles[high], color=BLUE, alpha=0.25, linewidth=0, label=label
    )
    for level in levels[1:-1]:
        axes.plot(w, curves.quantiles[level], color=BLUE, label=f"{100 * level:g} %")
    if curves.r_u is not None:
        axes.plot(w, curves.r_u, color=BLACK, linestyle=DOTTED, label="r_u, predicted")
    if curves.r_adm is not None:
        admitted = positive(curves.r_adm)
        beyond = curves.quantiles[high] > admitted
        if np.any(beyond):
            label = f"where more than {100 * (1.0 - high):.2g} % of the runs leave r_adm"
            outer = curves.quantiles[high]
            axes.fill_between(w, admitted, outer, where=beyond, color=ORANGE, linewidth=0, label=label)
        plot_admitted(axes, w, curves.r_adm)


def draw_loss(page: Figure, curves: LossCurves, time_unit: str) -> None:
    """A histogram for each input on common bins, with its mean as a vertical line."""
    axes = page.add_subplot()
    top = max(float(np.quantile(loss, SHOWN)) for loss in curves.losses.values())
    bins = np.linspace(0.0, top, BINS + 1)
    for index, (name, loss) in enumerate(curves.losses.items()):
        colour = COLOURS[index % len(COLOURS)]
        weights = np.full(loss.size, 100.0 / loss.size)
        label = f"{name}: mean {loss.mean():.4g}, sd {loss.std(ddof=1):.4g}"
        axes.hist(loss, bins=bins.tolist(), weights=weights, color=colour, alpha=SHADE, label=label)
        axes.axvline(float(loss.mean()), color=colour, linewidth=1.8)
        if name in curves.theory:
            axes.axvline(curves.theory[name], color=colour, linewidth=1.4, linestyle=(0, (4, 3)))
    axes.set_xlabel("loss of a run, √(Σ |y − y₀|²)\n(solid: mean of the runs, dashed: theory)")
    axes.set_ylabel("share of the runs (%)")
    axes.set_xlim(0.0, top)
    legend_above(axes)
