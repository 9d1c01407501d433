"""A panel for every entry of G, outputs as rows; one entry alone has the page to itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import Protocol, TypeVar

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    GREY,
    frequency_axis,
    legend_above,
    legend_over_all,
    log_axes,
    lowered,
)
from inputdesign_cli.runs.results import Array


class Panel(Protocol):
    """Curves over frequency that belong to one entry of G."""

    @property
    def frequency(self) -> Array:
        """(n,) rad per time unit."""

    @property
    def entry(self) -> tuple[int, int] | None:
        """Output and input from zero; None: the only entry, or all of them together."""

    @property
    def names(self) -> str:
        """Of its input and output; empty where there are none."""


P = TypeVar("P", bound=Panel)


def draw_panels(
    page: Figure,
    panels: Sequence[P],
    plot: Callable[[Axes, P], list[Artist]],
    time_unit: str,
    *,
    magnitude: str,
    title: str | None = None,
) -> None:
    """Draw each panel with `plot`, which returns the handles of its legend.

    Args:
        page: the figure.
        panels: what to draw, in any order.
        plot: draws one panel.
        time_unit: frequencies are labelled rad per this.
        magnitude: the label of the vertical axis where one panel stands alone.
        title: says what all panels are about.
    """
    if len(panels) == 1:
        (panel,) = panels
        axes = page.add_subplot()
        handles = plot(axes, panel)
        frequency_axis(axes, panel.frequency, time_unit)
        axes.set_ylabel(magnitude)
        if title or panel.names:
            axes.set_title(title or panel.names, loc="right", color=GREY)
        legend_above(axes, handles)
        return
    places = [panel.entry or (0, 0) for panel in panels]
    rows, columns = (1 + max(place[side] for place in places) for side in (0, 1))
    grid = page.subplots(rows, columns, sharex=True, squeeze=False)
    longest: list[Artist] = []
    for panel, (i, j) in zip(panels, places, strict=True):
        axes = grid[i, j]
        longest = max(longest, plot(axes, panel), key=len)
        log_axes(axes, "x")
        axes.set_xlim(float(panel.frequency.min()), float(panel.frequency.max()))
        axes.set_title(f"G{lowered(i + 1, j + 1)} {panel.names}".strip(), loc="left", color=GREY)
    for i, j in product(range(rows), range(columns)):
        if (i, j) not in places:
            grid[i, j].set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel(f"ω (rad/{time_unit})")
    legend_over_all(page, longest, title)
