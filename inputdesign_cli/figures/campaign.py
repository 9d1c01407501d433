"""campaign.png, estimates.png, true_ratio.png and cost_coverage.png: how campaigns go, one or many."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    DOTTED,
    ORANGE,
    PALETTE,
    legend_above,
    legend_over_all,
    page_of_pairs,
    plain_decades,
)
from inputdesign_cli.outcome.curves import CampaignCurves, EstimateCurves, RatioCurves, TradeCurves

COLUMNS = 3
# With few runs, fine bins would show each run separately.
BINS, RUNS_A_BIN = 40, 4
SHOWN = 0.99
WIDE = 5.0  # costs beyond it are shown over their logarithm


def draw_campaign(page: Figure, curves: CampaignCurves, time_unit: str) -> None:
    """The worst ratio falls to one while the energy rises, over the samples."""
    upper, lower = page.subplots(2, 1, sharex=True)
    upper.plot(curves.samples, curves.ratio, "o-", color=BLUE, markersize=4, label="after each part")
    upper.axhline(1.0, color=ORANGE, linestyle=DASHED, label="what is asked")
    plain_decades(upper, "y")
    upper.set_ylabel("worst ratio")
    lower.plot(curves.samples, curves.energy, "o-", color=BLUE, markersize=4)
    lower.set_ylim(bottom=0.0)
    lower.set_ylabel("energy applied")
    lower.set_xlabel("samples applied")
    if 2 * curves.samples[-1] > curves.end:
        lower.axvline(curves.end, color=BLACK, linestyle=DASHED)
    legend_above(upper)


def draw_estimates(page: Figure, curves: EstimateCurves, time_unit: str) -> None:
    """One panel a parameter: the estimate after each part with two standard deviations."""
    for axes, name in zip(page_of_pairs(page, len(curves.estimates), COLUMNS), curves.estimates, strict=True):
        middle, spread = curves.estimates[name], 2.0 * curves.deviations[name]
        axes.plot(curves.samples, middle, "o-", color=BLUE, markersize=3, label="estimate")
        band, label = (middle - spread, middle + spread), "two standard deviations"
        axes.fill_between(curves.samples, *band, color=BLUE, alpha=0.25, linewidth=0, label=label)
        # The first estimates know so little that their band would hide the rest.
        near = spread <= 5.0 * np.median(spread)
        low, high = (middle[near] + side * 1.2 * spread[near] for side in (-1.0, 1.0))
        axes.set_ylim(float(low.min()), float(high.max()))
        axes.set_title(name)
        axes.set_xlabel("samples")
    legend_over_all(page)


def draw_true_ratio(page: Figure, curves: RatioCurves, time_unit: str) -> None:
    """A histogram for each way on common bins; at one the true plant has what is asked."""
    axes = page.add_subplot()
    everything = np.concatenate(list(curves.ratios.values()))
    low, top = float(everything.min()), float(np.quantile(everything, SHOWN))
    runs = max(ratios.size for ratios in curves.ratios.values())
    number = int(np.clip(runs // RUNS_A_BIN, 2 * COLUMNS, BINS))
    low, top = min(low, 0.95), max(top, 1.05)
    step = (top - low) / number
    # An edge at one: no bin mixes runs that meet the requirement with runs that miss it.
    bins = (1.0 + step * np.arange(np.floor((low - 1.0) / step), np.ceil((top - 1.0) / step) + 1.0)).tolist()
    for (name, ratios), colour in zip(curves.ratios.items(), PALETTE, strict=False):
        shares = np.full(ratios.size, 100.0 / max(ratios.size, 1))
        filled = name == "campaign"
        axes.hist(
            np.minimum(ratios, bins[-1]),
            bins=bins,
            weights=shares,
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
    """Mean cost against the share of runs within r_adm, each with its spread; the oracle's at cost one."""
    axes = page.add_subplot()
    for (name, point), colour in zip(curves.points.items(), PALETTE, strict=False):
        cost, cheap, dear, share, low, high = point
        axes.plot([cheap, dear], [100 * share, 100 * share], color=colour, linewidth=1.2)
        axes.plot([cost, cost], [100 * low, 100 * high], color=colour, linewidth=1.2)
        axes.plot([cost], [100 * share], "o", color=colour, markersize=7, label=name.replace("_", " "))
    axes.axvline(1.0, color=BLACK, linestyle=DASHED, label="knows the plant: its spectrum")
    if curves.record is not None:
        axes.axvline(curves.record, color=BLACK, linestyle=DOTTED, label="knows the plant: its record")
    if max(dear for _, _, dear, *_ in curves.points.values()) > WIDE:
        plain_decades(axes, "x")
    axes.set_xlabel("cost over that of the spectrum that knows the plant\n(mean, 5 to 95 %)")
    axes.set_ylabel("runs within r_adm (%), 95 % limits")
    axes.set_ylim(top=101.0)
    legend_over_all(page)
