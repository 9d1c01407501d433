"""The look that all figures share: a canvas without global state, a palette, units on the axes."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Sequence
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator, NullFormatter

from inputdesign_cli.runs.results import Array

FileType = Literal["png", "svg"]

SIZE = (7.0, 4.5)  # inches
NARROW = (4.6, 3.4)
DPI = 150

# Okabe and Ito's palette, which stays apart for colour-blind readers.
BLACK = "#000000"
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
GREY = "#777777"
PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")

DASHED = (0, (5, 2))
DOTTED = (0, (1, 1.2))

_LOWERED = str.maketrans("ur0123456789", "ᵤᵣ₀₁₂₃₄₅₆₇₈₉")
_RAISED = str.maketrans("-.0123456789", "⁻·⁰¹²³⁴⁵⁶⁷⁸⁹")

_RC: dict[Any, Any] = {
    "svg.hashsalt": "idesign",
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
    # Names and units are the user's: no $ begins a formula, and ours are plain text too.
    "text.parse_math": False,
}


def lowered(*indices: str | int) -> str:
    """Indices as plain text: `₁₂`, and `₁₀,₂` where one has two digits."""
    texts = [str(index) for index in indices]
    apart = "," if len(texts) > 1 and any(len(text) > 1 for text in texts) else ""
    return apart.join(texts).translate(_LOWERED)


class _LogTicks(LogFormatterSciNotation):
    """10⁻² as plain text: typesetting formulas takes a third of the time of a figure."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        formula = re.fullmatch(r"\$\\mathdefault\{(.*?)(?:\^\{(.*)\})?\}\$", super().__call__(x, pos))
        if formula is None:
            return ""
        return formula[1].replace(r"\times", "×") + (formula[2] or "").translate(_RAISED)


def rendered(paint: Callable[[Figure], object], file_type: FileType = "png") -> bytes:
    """The file of a figure that `paint` draws on an empty page.

    A PNG of 7 by 4.5 inches, or a smaller SVG whose text stays readable on a phone.
    """
    narrow = file_type == "svg"
    buffer = io.BytesIO()
    with mpl.rc_context(_RC), warnings.catch_warnings():
        # A box stands for a letter of the user's that the font lacks; tables and pages have it.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        canvas = FigureCanvasAgg(painted(paint, NARROW if narrow else SIZE))
        if narrow:
            # Without a date and with ids that do not change, the same figure is the same file.
            canvas.print_figure(buffer, format="svg", metadata={"Date": None, "Creator": None})
        else:
            canvas.print_png(buffer)
    return buffer.getvalue()


def painted(paint: Callable[[Figure], object], size: tuple[float, float] = SIZE) -> Figure:
    """The figure that `paint` draws on an empty page."""
    with mpl.rc_context(_RC):
        page = Figure(figsize=size, dpi=DPI, layout="constrained")
        paint(page)
    return page


def frequency_axis(axes: Axes, frequencies: Array, time_unit: str) -> None:
    """A logarithmic axis over the positive ones of `frequencies`, in rad per time unit."""
    positive = frequencies[frequencies > 0]
    if positive.size:
        log_axes(axes, "x")
    if positive.size > 1:
        axes.set_xlim(positive.min(), positive.max())
    axes.set_xlabel(f"frequency ω (rad/{time_unit})")


def log_axes(axes: Axes, which: Literal["x", "y"], nonpositive: Literal["clip", "mask"] = "clip") -> None:
    """Make one axis logarithmic, `nonpositive` values at its lower end or left out."""
    set_scale, axis = (axes.set_xscale, axes.xaxis) if which == "x" else (axes.set_yscale, axes.yaxis)
    set_scale("log", nonpositive=nonpositive)
    axis.set_major_formatter(_LogTicks())
    axis.set_minor_formatter(_LogTicks())


def plain_decades(axes: Axes, which: Literal["x", "y"]) -> None:
    """Make one axis logarithmic over a few decades about one: 0.5, 1, 2, 5 in place of powers of ten."""
    log_axes(axes, which)
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def marked(axes: Axes, x: Array, y: Array, *, color: str, label: str) -> list[Line2D]:
    """Rings around points of a curve."""
    (rings,) = axes.plot(x, y, "o", markersize=6, clip_on=False, zorder=5, label=label)
    rings.set(markerfacecolor="white", markeredgecolor=color, markeredgewidth=1.5)
    return [rings]


def page_of_pairs(page: Figure, pairs: int, columns: int) -> list[Axes]:
    """Axes for so many pairs of parameters, row by row."""
    columns = min(columns, pairs)
    grid = list(page.subplots(-(-pairs // columns), columns, squeeze=False).flat)
    for axes in grid[pairs:]:
        axes.set_axis_off()
    for axes in grid[:pairs]:
        axes.locator_params(nbins=4)
    return grid[:pairs]


def legend_above(axes: Axes, handles: Sequence[Artist]) -> None:
    """A legend over the axes, where it cannot cover a curve."""
    page = axes.get_figure(root=True)
    assert page is not None
    narrow = page.get_figwidth() < SIZE[0]
    longest = max((len(str(handle.get_label())) for handle in handles), default=0)
    axes.legend(
        handles=handles,
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=max(1, min(3, 46 // (longest + 6))) if narrow else len(handles),
        borderaxespad=0.3,
        handlelength=2.2,
        columnspacing=1.4,
    )


def legend_over_all(page: Figure, handles: Sequence[Artist], title: str | None = None) -> None:
    """One legend for all panels of a page, above them."""
    page.legend(handles=handles, loc="outside upper left", ncols=len(handles), title=title, alignment="left")
