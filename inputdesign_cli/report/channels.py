"""bound.png of several channels: a panel an entry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist

from inputdesign_cli.outcome import ChannelBoundCurves
from inputdesign_cli.report.bound import plot_bound
from inputdesign_cli.report.style import GREY, figure


def draw_channel_bounds(curves: ChannelBoundCurves, path: Path, time_unit: str) -> None:
    """A panel for every entry of G, outputs as rows."""
    places = {name: tuple(int(part) for part in re.findall(r"\d+", name)) for name in curves.entries}
    rows, columns = (max(place[axis] for place in places.values()) for axis in (0, 1))
    with figure(path) as page:
        grid: Any = page.subplots(rows, columns, sharex=True, squeeze=False)
        handles: list[Artist] = []
        for name, entry in curves.entries.items():
            i, j = places[name]
            axes = grid[i - 1][j - 1]
            found = plot_bound(axes, entry)
            handles = max(handles, found, key=len)
            axes.set_xscale("log")
            axes.set_xlim(float(entry.frequency.min()), float(entry.frequency.max()))
            axes.set_title(f"$G_{{{i}{j}}}$", loc="left", color=GREY)
        drawn = {(i - 1, j - 1) for i, j in places.values()}
        for i, j in np.ndindex(rows, columns):
            if (i, j) not in drawn:
                grid[i][j].set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel(rf"$\omega$ (rad/{time_unit})")
        page.legend(handles=handles, loc="outside upper left", ncols=len(handles))
