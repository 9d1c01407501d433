"""Figures of many experiments, or of many parts of one: ratios, costs and losses."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    DOTTED,
    GREEN,
    GREY,
    ORANGE,
    PALETTE,
    legend_above,
    legend_over_all,
    plain_decades,
)
from inputdesign_cli.outcome.curves import CampaignCurves, LossCurves, RatioCurves, TradeCurves

_COLOURS = (BLUE, ORANGE, GREEN, GREY)
# With few runs, fine bins would show each run separately.
_FEWEST_BINS, _BINS, _RUNS_A_BIN = 6, 40, 4
# Shares of the ratios and of the losses that are shown: few runs of the tail would squeeze the rest.
_RATIOS, _LOSSES = 0.99, 0.998
_WIDE = 5.0  # costs beyond it are shown over their logarithm


def draw_campaign(page: Figure, curves: CampaignCurves, time_unit: str) -> None:
    """Draw the worst ratio, which falls to one, and the energy, which rises, over the samples."""
    upper, lower = page.subplots(2, 1, sharex=True)
    upper.plot(curves.samples, curves.ratio, "o-", color=BLUE, markersize=4, label="after each part")
    upper.axhline(1.0, color=ORANGE, linestyle=DASHED, label="what is asked")
    plain_decades(upper, "y")
    upper.set_ylabel("worst ratio")
    lower.plot(curves.samples, curves.energy, "o-", color=BLUE, markersize=4)
    lower.set_ylim(bottom=0.0)
    lower.set(xlabel="samples applied", ylabel="energy applied")
    if 2 * curves.samples[-1] > curves.end:
        lower.axvline(curves.end, color=BLACK, linestyle=DASHED)
    legend_above(upper)


def draw_true_ratio(page: Figure, curves: RatioCurves, time_unit: str) -> None:
    """Draw a histogram of the true ratio for each way, on common bins; up to one the requirement is met."""
    axes = page.add_subplot()
    everything = np.concatenate(list(curves.ratios.values()))
    low, top = min(float(everything.min()), 0.95), max(float(np.quantile(everything, _RATIOS)), 1.05)
    runs = max(ratios.size for ratios in curves.ratios.values())
    step = (top - low) / int(np.clip(runs // _RUNS_A_BIN, _FEWEST_BINS, _BINS))
    # An edge at one: no bin mixes runs that meet the requirement with runs that miss it.
    bins = (1.0 + step * np.arange(np.floor((low - 1.0) / step), np.ceil((top - 1.0) / step) + 1.0)).tolist()
    for (name, ratios), colour in zip(curves.ratios.items(), PALETTE, strict=False):
        filled = name == "campaign"
        axes.hist(
            np.minimum(ratios, bins[-1]),
            bins=bins,
            weights=np.full(ratios.size, 100.0 / max(ratios.size, 1)),
            color=colour,
            alpha=0.45 if filled else 1.0,
            histtype="stepfilled" if filled else "step",
            linewidth=1.4,
            label=name.replace("_", " "),
        )
    axes.axvline(1.0, color=BLACK, linestyle=DASHED)
    axes.set_xlabel("largest r_u / r_adm of the true plant\n(beyond the last bin: in it)")
    axes.set_ylabel("share of the runs (%)")
    legend_over_all(page)


def draw_trade(page: Figure, curves: TradeCurves, time_unit: str) -> None:
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
        plain_decades(axes, "x")
    axes.set_xlabel("cost over that of the spectrum that knows the plant\n(mean, 5 to 95 %)")
    axes.set_ylabel("runs within r_adm (%), 95 % limits")
    axes.set_ylim(top=101.0)
    legend_over_all(page)


def draw_loss(page: Figure, curves: LossCurves, time_unit: str) -> None:
    """Draw the histogram of the loss for each input on common bins, with its mean as a vertical line."""
    axes = page.add_subplot()
    top = max(float(np.quantile(loss, _LOSSES)) for loss in curves.losses.values())
    bins = np.linspace(0.0, top, _BINS + 1).tolist()
    for index, (name, loss) in enumerate(curves.losses.items()):
        colour = _COLOURS[index % len(_COLOURS)]
        weights = np.full(loss.size, 100.0 / loss.size)
        label = f"{name}: mean {loss.mean():.4g}, sd {loss.std(ddof=1):.4g}"
        axes.hist(loss, bins=bins, weights=weights, color=colour, alpha=0.45, label=label)
        axes.axvline(float(loss.mean()), color=colour, linewidth=1.8)
        if name in curves.theory:
            axes.axvline(curves.theory[name], color=colour, linewidth=1.4, linestyle=(0, (4, 3)))
    axes.set_xlabel("loss of a run, √(Σ |y − y₀|²)\n(solid: mean of the runs, dashed: theory)")
    axes.set(ylabel="share of the runs (%)", xlim=(0.0, top))
    legend_above(axes)
