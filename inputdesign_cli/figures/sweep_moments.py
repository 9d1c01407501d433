"""moments.png: the designed moments of a regression over one key, as in [eckhard-mse], Figures 1, 2."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import BLACK, DASHED, PALETTE, legend_above, log_axes, lowered
from inputdesign_cli.figures.sweep_axes import LOG_FROM, curve, mark_failures, plain_numbers, scale_key
from inputdesign_cli.figures.sweep_table import SweepTable

_PREFIX = "moments.entries."
_TRACE = "moments.trace"
MOST_ENTRIES = len(PALETTE)


def moment_entries(table: SweepTable) -> list[str]:
    """The columns of R to draw: its upper triangle, or of a large R its diagonal; none without moments."""
    if table.numbers(_TRACE) is None:
        return []
    found = [name for name in table.columns if name.startswith(_PREFIX) and table.numbers(name) is not None]
    if len(found) > MOST_ENTRIES:
        found = [name for name in found if len(set(_place(name))) == 1]
    return found[:MOST_ENTRIES]


def draw_moments(table: SweepTable, along: str, page: Figure) -> None:
    """R11, R12, .. and the trace over a key, crosses where a point has no result.

    The axis is logarithmic if the trace spans more than a decade and no entry is zero or negative.
    """
    x, trace = table.numbers(along), table.numbers(_TRACE)
    assert x is not None
    assert trace is not None
    entries = moment_entries(table)
    # Entries may coincide (R11 = R22 if the regressors are delayed copies): the later, the thinner.
    widths = np.linspace(5.0, 1.2, len(entries))
    axes = page.add_subplot()
    handles: list[Artist] = []
    values = [trace]
    for name, colour, width in zip(entries, PALETTE, widths, strict=False):
        y = table.numbers(name)
        assert y is not None
        handles += curve(axes, x, y, color=colour, linewidth=width, label=f"R{lowered(*_place(name))}")
        values.append(y)
    handles += curve(axes, x, trace, color=BLACK, linestyle=DASHED, label="trace R")
    mark_failures(axes, x[~np.isfinite(trace)])
    span = float(np.nanmax(trace) / np.nanmin(trace))
    if span > LOG_FROM and min(float(np.nanmin(part)) for part in values) > 0:
        log_axes(axes, "y")
        plain_numbers(axes.yaxis, span)
    scale_key(axes, along, x)
    axes.set_ylabel("moments, summed over the samples")
    legend_above(axes, handles)


def _place(name: str) -> list[str]:
    """Row and column of an entry, from 1."""
    return name.removeprefix(_PREFIX).split("_")[1:]
