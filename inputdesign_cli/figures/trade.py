"""trade.png: accuracy over the length of the experiment, a curve for each amplitude."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from inputdesign_cli.figures.style import BLACK, DASHED, legend_above, log_axes, stroke
from inputdesign_cli.figures.sweep_axes import curve, mark_failures, plain_numbers
from inputdesign_cli.outcome.results import Array


@dataclass(frozen=True)
class Trade:
    """The worst ratio to the requirement, or the criterion, over lengths (in `unit`) and amplitudes.

    Args:
        amplitudes: their texts, one where only the length was varied.
        values: (amplitudes, lengths), NaN without a result.
        criterion: whether the values are a criterion, and not ratios that are to be one at most.
    """

    lengths: Array
    unit: str
    amplitudes: tuple[str, ...]
    values: Array
    criterion: bool


def draw_trade(trade: Trade, page: Figure) -> None:
    """Ratios to what is asked, which stands at one, or the criterion."""
    axes = page.add_subplot()
    for number, (text, row) in enumerate(zip(trade.amplitudes, trade.values, strict=True)):
        name = f"amplitude {text}" if text else "best record"
        colour, dashes = stroke(number)
        drawn = {"color": colour, "linestyle": dashes, "label": name}
        curve(axes, trade.lengths, row, marker="o", markersize=4, **drawn)
    log_axes(axes, "x")
    axes.set_xticks(trade.lengths, [f"{length:g}" for length in trade.lengths])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(f"length of the experiment ({trade.unit})")
    mark_failures(axes, trade.lengths[np.all(np.isnan(trade.values), axis=0)])
    if trade.criterion:
        axes.set_ylabel("criterion")
    else:
        axes.axhline(1.0, color=BLACK, linestyle=DASHED, linewidth=1.1, label="what is asked")
        known = np.append(trade.values[np.isfinite(trade.values)], 1.0)
        log_axes(axes, "y")
        plain_numbers(axes.yaxis, float(known.max() / known.min()))
        axes.set_ylabel("error of the record / what is asked")
    legend_above(axes)
