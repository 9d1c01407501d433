"""A panel for every entry of G, outputs as rows; one entry alone has the page to itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol, TypeVar

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from inputdesign_cli.figures.style import (
    GREY,
    frequency_axis,
    legend_above,
    legend_over_all,
    lowered,
    title_above,
)
from inputdesign_cli.outcome.results import Array

# How much higher a page is with a panel under one other, or under several.
_TALL, _TALLER = 1.25, 1.4


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
        """Return the names of its input and output; empty if there are none."""


P = TypeVar("P", bound=Panel)


def draw_panels(
    page: Figure,
    panels: Sequence[P],
    plot: Callable[[Axes, P], None],
    time_unit: str,
    *,
    magnitude: str,
    title: str | None = None,
    below: Callable[[Axes, Sequence[P]], object] | None = None,
) -> None:
    """Draw each panel with `plot`, and all of them together with `below`.

    Args:
        page: the figure.
        panels: what to draw, in any order.
        plot: draws one panel.
        time_unit: frequencies are labelled rad per this.
        magnitude: the label of the vertical axes, of those at the left.
        title: says what all panels are about.
        below: draws a further panel under all others.
    """
    single = len(panels) == 1
    places = [(0, 0)] if single else [panel.entry or (0, 0) for panel in panels]
    rows, columns = (1 + max(place[side] for place in places) for side in (0, 1))
    heights = [3] * rows
    if below is not None:
        page.set_figheight((_TALL if single else _TALLER) * page.get_figheight())
        heights.append(2)
    cells = page.add_gridspec(len(heights), columns, height_ratios=heights)
    for panel, (i, j) in zip(panels, places, strict=True):
        axes = page.add_subplot(cells[i, j])
        plot(axes, panel)
        frequency_axis(axes, panel.frequency, time_unit)
        if not any(row == i and column < j for row, column in places):
            axes.set_ylabel(magnitude)
        if single:
            title = ": ".join(filter(None, (title, panel.names)))
        else:
            axes.set_label(f"G{lowered(i + 1, j + 1)} {panel.names}".strip())
            axes.set_title(str(axes.get_label()), loc="left", color=GREY)
        if below is not None or any(row > i and column == j for row, column in places):
            axes.tick_params(which="both", labelbottom=False)
            axes.set_xlabel("")
    if title and single:
        title_above(page, title)
    if single:
        legend_above(axes)
    else:
        legend_over_all(page, title=title)
    if below is not None:
        lowest = page.add_subplot(cells[rows, :])
        below(lowest, panels)
        frequency_axis(lowest, panels[0].frequency, time_unit)
        if lowest.get_legend() is None:
            legend_above(lowest)
