"""ellipses.png: where the estimates of some pairs of parameters are to be expected."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, GREY, legend_over_all, page_of_pairs
from inputdesign_cli.outcome.curves import Ellipse, EllipseCurves
from inputdesign_cli.outcome.results import Array

COLUMNS = 3
POINTS = 200
_TICKS = 2  # intervals between numbers: these are wide for three columns


def draw_ellipses(page: Figure, curves: EllipseCurves, time_unit: str) -> None:
    """One panel a pair: the region that holds the estimate with the probability of the title."""
    grid = page_of_pairs(page, len(curves.pairs), COLUMNS)
    for axes, pair in zip(grid, curves.pairs, strict=True):
        axes.locator_params(axis="x", nbins=_TICKS)
        _draw(axes, pair, curves.probability)
    legend_over_all(page)


def _draw(axes: Axes, pair: Ellipse, probability: float) -> None:
    label = f"{100 * probability:g} % of estimates"
    axes.plot(*boundary(pair.center, pair.covariance, probability), color=BLUE, linewidth=1.8, label=label)
    if pair.white is not None:
        outline = boundary(pair.center, pair.white, probability)
        axes.plot(*outline, color=GREY, linestyle=DASHED, linewidth=1.2, label="flat input")
    axes.plot(*pair.center, marker="+", color=BLACK, linestyle="none", label="nominal")
    axes.set_xlabel(pair.names[0])
    axes.set_ylabel(pair.names[1])


def boundary(center: Array, covariance: Array, probability: float) -> Array:
    """(2, points): the ellipse with (x - center)^T covariance^-1 (x - center) = chi-squared (2 freedoms)."""
    radius = np.sqrt(-2.0 * np.log(1.0 - probability))
    angle = np.linspace(0.0, 2.0 * np.pi, POINTS)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    # The covariance of nearly unidentifiable parameters is singular, to rounding.
    scale = np.sqrt(np.diag(covariance))
    sizes, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * axes * np.sqrt(np.maximum(sizes, 0.0))
    return center[:, None] + radius * root @ circle
