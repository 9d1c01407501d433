"""Figures of parameters, structures and moments, and of many experiments or many parts of one."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from inputdesign_cli.figures import style
from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, DOTTED, GREY, ORANGE, PALETTE
from inputdesign_cli.outcome import curves as of
from inputdesign_cli.outcome.results import Array

_POINTS = 200  # points of an ellipse
_BEHIND = (0.01, 100.0)  # range of the axis of points of fit below the best
_OPAQUE = 0.8  # opacity of the cells of a matrix
_NUMBERED = 8  # rows up to which the entries are written into the cells
_MOST_NUMBERS = 10  # ticks along a matrix at most
_SHOWN = 0.99  # share of the runs within the axis: few runs in the tail would squeeze the rest
_WIDE = 5.0  # relative cost beyond which its axis is logarithmic


def boundary(center: Array, covariance: Array, probability: float) -> Array:
    """Return the ellipse (x - center)^T covariance^-1 (x - center) = chi-squared(2) as (2, points)."""
    radius = np.sqrt(-2.0 * np.log(1.0 - probability))
    angle = np.linspace(0.0, 2.0 * np.pi, _POINTS)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    # The covariance of nearly unidentifiable parameters is singular, to rounding.
    scale = np.sqrt(np.diag(covariance))
    sizes, axes = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * axes * np.sqrt(np.maximum(sizes, 0.0))
    return center[:, None] + radius * root @ circle


def draw_ellipses(page: Figure, curves: of.EllipseCurves, time_unit: str) -> None:
    """Draw the confidence ellipse of each pair of parameters, with the estimates of simulated runs."""
    runs = any(pair.estimates is not None for pair in curves.pairs)
    share = f"{100 * curves.probability:g} % {'ellipse of theory' if runs else 'of estimates'}"
    for axes, pair in zip(style.panels(page, len(curves.pairs), 2 if runs else 3), curves.pairs, strict=True):
        axes.locator_params(nbins=4)
        if pair.estimates is not None:
            (dots,) = axes.plot(*pair.estimates.T, ".", color=BLUE, markersize=2.5, alpha=0.5)
            dots.set(rasterized=True, label=f"{len(pair.estimates)} estimates")
        outline = boundary(pair.center, pair.covariance, curves.probability)
        axes.plot(*outline, color=ORANGE if runs else BLUE, linewidth=1.8, label=share)
        if pair.white is not None:
            outline = boundary(pair.center, pair.white, curves.probability)
            axes.plot(*outline, color=GREY, linestyle=DASHED, linewidth=1.2, label="flat input")
        (center,) = axes.plot(*pair.center, "+", color=BLACK, markersize=9, markeredgewidth=1.6)
        center.set_label("truth" if runs else "nominal")
        axes.set(xlabel=pair.names[0], ylabel=pair.names[1])
        low, high = axes.get_xlim()
        inside = [tick for tick in axes.get_xticks() if low <= tick <= high]
        axes.set_xticks(inside[:: max(len(inside) - 1, 1)])  # numbers are wide for three columns
    style.legend_over_all(page)


def draw_estimates(page: Figure, curves: of.EstimateCurves, time_unit: str) -> None:
    """Draw each parameter in a panel: the estimate after each part, with two standard deviations."""
    for axes, name in zip(style.panels(page, len(curves.estimates), 3), curves.estimates, strict=True):
        axes.locator_params(nbins=4)
        middle, spread = curves.estimates[name], 2.0 * curves.deviations[name]
        axes.plot(curves.samples, middle, "o-", color=BLUE, markersize=3, label="estimate")
        label = "two standard deviations"
        style.band(axes, curves.samples, middle - spread, middle + spread, BLUE, 0.25, label=label)
        # The wide bands of the first estimates would hide the rest.
        near = spread <= 5.0 * np.median(spread)
        low, high = (middle[near] + side * 1.2 * spread[near] for side in (-1.0, 1.0))
        axes.set(ylim=(float(low.min()), float(high.max())), title=name, xlabel="samples")
    style.legend_over_all(page)


def draw_orders(page: Figure, curves: of.OrderCurves, time_unit: str) -> None:
    """Draw the distance of each structure's fit to the best, in decades, over the number of parameters."""
    axes = page.subplots()
    best = max(float(np.max(fit)) for _, fit in curves.fits.values())
    for number, (family, (sizes, fit)) in enumerate(curves.fits.items()):
        color, marker = style.point(number)
        behind = np.clip(best - fit, *_BEHIND)
        axes.plot(sizes, behind, marker, color=color, markersize=5, alpha=0.8, label=family)
    size, chosen = curves.chosen
    (ring,) = axes.plot(size, np.clip(best - chosen, *_BEHIND), "o", color=BLACK, markersize=12)
    ring.set(markerfacecolor="none", label=f"chosen, fit {chosen:.4g} %")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_yscale("log")
    axes.set_ylim(1.6 * _BEHIND[1], 0.6 * _BEHIND[0])
    ticks = np.geomspace(*_BEHIND, 5)
    axes.set_yticks(ticks, ["0.01\nor less", *(f"{tick:g}" for tick in ticks[1:-1]), "100\nor more"])
    name = "y" if curves.output is None else f"y{curves.output + 1}"
    which = "unseen data" if curves.unseen else "the data that estimate"
    axes.set_xlabel(f"parameters; fit of {name} on {which}")
    axes.set_ylabel(f"points below the\nbest fit, {best:.4g} %")
    style.legend_over_all(page)


def draw_moments(page: Figure, curves: of.MomentsCurves, time_unit: str) -> None:
    """Draw R as a coloured matrix, its estimated block framed, and the power of each line of the input."""
    if curves.line_frequency is None or curves.line_power is None:
        _draw_matrix(page.add_subplot(), curves)
        return
    matrix, lines = page.subplots(1, 2, width_ratios=[1, 1])
    _draw_matrix(matrix, curves)
    lines.vlines(curves.line_frequency, 0.0, curves.line_power, color=BLUE, linewidth=1.8)
    lines.plot(curves.line_frequency, curves.line_power, "o", color=BLUE, markersize=5)
    lines.set_xlim(-0.03 * curves.nyquist, 1.03 * curves.nyquist)
    lines.set_ylim(0.0, 1.08 * float(curves.line_power.max()))
    lines.set(xlabel=style.frequency_label(time_unit), ylabel="power of each line (mean square)")


def _draw_matrix(axes: Axes, curves: of.MomentsCurves) -> None:
    R, n, m = curves.R, len(curves.R), curves.estimated
    largest = float(np.abs(R).max())
    drawn = axes.imshow(R, cmap="RdBu", vmin=-largest, vmax=largest, alpha=_OPAQUE)
    axes.grid(False)
    numbered = range(0, n, 1 + n // _MOST_NUMBERS)
    axes.set_xticks(numbered, [str(i + 1) for i in numbered])
    axes.set_yticks(numbered, [str(i + 1) for i in numbered])
    axes.set_title(f"R, trace {np.trace(R):.5g}; framed: estimated", loc="left")
    inner, edge = m - 0.5, -0.5
    axes.plot([edge, inner, inner], [inner, inner, edge], color=BLACK, linewidth=1.6)
    axes.set(xlim=(-0.5, n - 0.5), ylim=(n - 0.5, -0.5))
    for (i, j), value in np.ndenumerate(R if n <= _NUMBERED else np.zeros((0, 0))):
        colour = style.ink_on(drawn, value, _OPAQUE)
        axes.text(j, i, f"{value:.3g}", ha="center", va="center", color=colour)


def draw_error(page: Figure, curves: of.ErrorCurves, time_unit: str) -> None:
    """Draw squared bias and variance stacked over energy, the error of white regressors, and the design."""
    axes = page.add_subplot()
    energy, bias = curves.energy, curves.bias_squared
    total = bias + curves.variance
    style.band(axes, energy, np.zeros_like(bias), bias, ORANGE, 0.55, label="squared bias")
    style.band(axes, energy, bias, total, BLUE, 0.35, label="variance")
    axes.plot(energy, total, color=BLUE, linewidth=2.0)
    axes.plot(energy, curves.white, color=GREY, linestyle=DASHED, label="white")
    if curves.target is not None:
        axes.axhline(curves.target, color=BLACK, linewidth=0.9, label="target")
    axes.plot(*curves.design, "o", color=BLUE, markersize=7, label="design")
    style.log_axes(axes, "x")
    axes.set(xlim=(energy[0], energy[-1]), ylim=(0.0, 3.0 * curves.design[1]))
    axes.set(xlabel="energy, trace R", ylabel="mean-squared error")
    style.legend_above(axes)


def draw_campaign(page: Figure, curves: of.CampaignCurves, time_unit: str) -> None:
    """Draw the worst ratio, which falls to one, and the energy, which rises, over the samples."""
    upper, lower = page.subplots(2, 1, sharex=True)
    upper.plot(curves.samples, curves.ratio, "o-", color=BLUE, markersize=4, label="after each part")
    upper.axhline(1.0, color=ORANGE, linestyle=DASHED, label="what is asked")
    style.plain_decades(upper, "y")
    upper.set_ylabel("worst ratio")
    lower.plot(curves.samples, curves.energy, "o-", color=BLUE, markersize=4)
    lower.set_ylim(bottom=0.0)
    lower.set(xlabel="samples applied", ylabel="energy applied")
    if 2 * curves.samples[-1] > curves.end:
        lower.axvline(curves.end, color=BLACK, linestyle=DASHED)
    style.legend_above(upper)


def draw_runs(page: Figure, curves: of.RunCurves, time_unit: str) -> None:
    """Draw the distribution of the runs with each input, with means in theory or the limit of ratios."""
    axes = page.add_subplot()
    found = {name: np.sort(values) for name, values in curves.values.items() if values.size}
    everything = np.concatenate(list(found.values()))
    low, high = float(everything.min()), float(np.quantile(everything, _SHOWN))
    for number, (name, values) in enumerate(found.items()):
        colour, dashes = style.stroke(number)
        share = 100.0 * np.arange(1, values.size + 1) / values.size
        label = f"{name.replace('_', ' ')}: mean {values.mean():.4g}"
        (line,) = axes.plot(
            np.r_[low, values], np.r_[0.0, share], color=colour, linestyle=dashes, label=label
        )
        line.set_drawstyle("steps-post")
        if name in curves.theory:
            axes.axvline(curves.theory[name], color=colour, linewidth=1.0, linestyle=DOTTED)
    what = "loss of a run, √(Σ |y − y₀|²); dotted: mean by theory"
    if curves.limit is not None:
        what, low, high = "largest r_u / r_adm of the true plant", min(low, 0.95), max(high, 1.05)
        axes.axvline(curves.limit, color=BLACK, linestyle=DASHED, label="what is asked")
    if high > low:
        axes.set_xlim(low, high)
    axes.set(ylim=(0.0, 101.0), xlabel=what, ylabel="runs up to it (%)")
    style.legend_over_all(page)


def draw_trade(page: Figure, curves: of.TradeCurves, time_unit: str) -> None:
    """Draw the share of runs within r_adm over the mean cost, both with spread; the oracle's cost is one."""
    axes = page.add_subplot()
    for (name, point), colour in zip(curves.points.items(), PALETTE, strict=False):
        cost, cheap, dear, share, low, high = point
        axes.plot([cheap, dear], [100 * share, 100 * share], color=colour, linewidth=1.2)
        axes.plot([cost, cost], [100 * low, 100 * high], color=colour, linewidth=1.2)
        axes.plot([cost], [100 * share], "o", color=colour, markersize=7, label=name.replace("_", " "))
    axes.axvline(1.0, color=BLACK, linestyle=DASHED, label="knows the plant: its spectrum")
    if curves.record is not None:
        axes.axvline(curves.record, color=BLACK, linestyle=DOTTED, label="knows the plant: its record")
    if max(dear for _, _, dear, *_ in curves.points.values()) > _WIDE:
        style.plain_decades(axes, "x")
    axes.set_xlabel("cost over that of the spectrum that knows the plant\n(mean, 5 to 95 %)")
    axes.set_ylabel("runs within r_adm (%), 95 % limits")
    axes.set_ylim(top=101.0)
    style.legend_over_all(page)
