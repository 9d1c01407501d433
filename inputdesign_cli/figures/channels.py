"""bound.png of several channels: a panel an entry."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.bound import plot_bound
from inputdesign_cli.figures.style import GREY, figure
from inputdesign_cli.runs.results import ChannelBoundCurves


def draw_channel_bounds(curves: ChannelBoundCurves, path: Path, time_unit: str) -> None:
    """A panel for every entry of G, outputs as rows."""
    with figure(path) as page:
        handles: list[Artist] = []
        for axes, entry in entry_panels(page, curves.entries, time_unit):
            handles = max(handles, plot_bound(axes, entry), key=len)
        page.legend(handles=handles, loc="outside upper left", ncols=len(handles))


def entry_panels(page: Figure, entries: Mapping[str, Any], time_unit: str) -> Iterator[tuple[Axes, Any]]:
    """A panel for each of the `entries` ("[2,1]" -> curves over `frequency`), its axis set after drawing."""
    places = {name: tuple(int(part) for part in re.findall(r"\d+", name)) for name in entries}
    rows, columns = (max(place[axis] for place in places.values()) for axis in (0, 1))
    grid: Any = page.subplots(rows, columns, sharex=True, squeeze=False)
    for name, entry in entries.items():
        i, j = places[name]
        axes = grid[i - 1][j - 1]
        yield axes, entry
        axes.set_xscale("log")
        axes.set_xlim(float(entry.frequency.min()), float(entry.frequency.max()))
        axes.set_title(f"$G_{{{i}{j}}}$", loc="left", color=GREY)
    drawn = {(i - 1, j - 1) for i, j in places.values()}
    for i, j in np.ndindex(rows, columns):
        if (i, j) not in drawn:
            grid[i][j].set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel(rf"$\omega$ (rad/{time_unit})")
