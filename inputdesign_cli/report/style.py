"""The look that all figures share: a canvas without global state, a palette, units on the axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from inputdesign_cli.outcome import Array

SIZE = (7.0, 4.5)  # inches
DPI = 150

# Okabe and Ito's palette, which stays apart for colour-blind readers.
BLACK = "#000000"
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
GREY = "#777777"

_RC: dict[Any, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 10.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "mathtext.fontset": "dejavusans",
}


@contextmanager
def figure(path: Path) -> Iterator[Figure]:
    """A figure to draw on, saved to `path` as PNG when the block ends well."""
    with mpl.rc_context(_RC):
        canvas = FigureCanvasAgg(Figure(figsize=SIZE, dpi=DPI, layout="constrained"))
        yield canvas.figure
        canvas.print_png(path)


def frequency_axis(axes: Axes, frequencies: Array, time_unit: str) -> None:
    """A logarithmic axis over the positive ones of `frequencies`, in rad per time unit."""
    positive = frequencies[frequencies > 0]
    axes.set_xscale("log")
    if positive.size > 1:
        axes.set_xlim(positive.min(), positive.max())
    axes.set_xlabel(rf"frequency $\omega$ (rad/{time_unit})")


def legend_above(axes: Axes, handles: Sequence[Artist]) -> None:
    """A legend over the axes, where it cannot cover a curve."""
    axes.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(handles),
        borderaxespad=0.3,
        handlelength=2.2,
        columnspacing=1.4,
    )
