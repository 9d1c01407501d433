"""The look that all figures share: a canvas without global state, a palette, units on the axes."""

from __future__ import annotations

import io
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.markers import TICKDOWN, TICKLEFT
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.ticker import (
    FuncFormatter,
    LogFormatterSciNotation,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
    ScalarFormatter,
)
from matplotlib.typing import LineStyleType

from inputdesign_cli.outcome.results import Array

FileType = Literal["png", "svg", "pdf"]
FILE_TYPES: dict[str, FileType] = {"png": "png", "svg": "svg", "pdf": "pdf"}

DPI = 150
_COMPRESSED = 3  # level of nine: half the time of the usual six, for files a tenth larger
TYPE_SIZE = 9.5  # points
Width = Literal["page", "column", "phone"]
# Width and height in inches, and the size of the text in points: of a page, of a column in a paper, and of a
# page that may be read on a phone, where text is larger beside the curves.
_SIZES: dict[Width, tuple[float, float, float]] = {
    "page": (7.0, 4.5, TYPE_SIZE),
    "column": (3.5, 2.6, 0.7 * TYPE_SIZE),
    "phone": (5.0, 3.7, TYPE_SIZE),
}
_SIZES_OF_TEXT = (
    *("font.size", "axes.titlesize", "axes.labelsize", "figure.titlesize"),
    *("xtick.labelsize", "ytick.labelsize", "legend.fontsize"),
)

# Okabe and Ito's palette, which colour-blind readers can distinguish.
BLACK = "#000000"
BLUE = "#0072B2"
ORANGE = "#D55E00"
GREEN = "#009E73"
GREY = "#777777"
PALETTE = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9")
OTHERS = tuple(colour for colour in PALETTE if colour != ORANGE)  # for curves near a limit

# Inches of a handle in a legend beside its label, and of the numbers and the label beside a panel.
_BESIDE_LABEL, _BESIDE_AXES = 0.55, 0.85
_TITLE_PER_INCH = 13.0  # letters of a title that an inch of the page holds

PANEL, _ROW = 2.3, 0.4  # least inches of width of a panel, and share of the page height for a further row

# A logarithmic axis has even steps, at most as many as the second number, if its ends have a ratio below the
# first. Beyond the last ratio, only powers of ten have a number.
_EVEN, _STEPS, _WIDE = 8.0, 6, 1e4

DASHED = (0, (5, 2))
DOTTED = (0, (1, 1.2))

_LOWERED = str.maketrans("ur0123456789", "ᵤᵣ₀₁₂₃₄₅₆₇₈₉")
_RAISED = str.maketrans("-.0123456789", "⁻·⁰¹²³⁴⁵⁶⁷⁸⁹")

_RC: dict[Any, Any] = {
    "svg.hashsalt": "idesign",
    "svg.fonttype": "none",  # text stays text
    "pdf.fonttype": 42,  # TrueType, as journals ask for
    "mathtext.default": "regular",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    # Names and units are the user's: no $ begins a formula; our symbols are typeset one by one.
    "text.parse_math": False,
}


def lowered(*indices: str | int) -> str:
    """Return indices as plain text: `₁₂`, and `₁₀,₂` where one has two digits."""
    texts = [str(index) for index in indices]
    apart = "," if len(texts) > 1 and any(len(text) > 1 for text in texts) else ""
    return apart.join(texts).translate(_LOWERED)


class _LogTicks(LogFormatterSciNotation):
    """Writes 10⁻² as plain text: typesetting formulas takes a third of the time of a figure."""

    # Digits before a power of ten that are written: the first of the sets that gives an axis two numbers.
    sets, digits = ("1", "13", "1236", "123456789"), "1"

    def set_locs(self, locs: object = None) -> None:
        """Choose the digits by the range that the axis shows."""
        assert self.axis is not None
        low, high = sorted(self.axis.get_view_interval())
        decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.log10(high) + 1.0)
        for self.digits in _LogTicks.sets:
            numbers = np.outer([int(digit) for digit in self.digits], decades)
            if np.sum((low <= numbers) & (numbers <= high)) > 1:
                break

    def __call__(self, x: float, pos: int | None = None) -> str:
        formula = re.fullmatch(r"\$\\mathdefault\{(.*?)(?:\^\{(.*)\})?\}\$", super().__call__(x, pos))
        if formula is None or formula[1][:1] not in self.digits:
            return ""
        return formula[1].replace(r"\times", "×") + (formula[2] or "").translate(_RAISED)


class _Numbers(ScalarFormatter):
    """Writes 2e-18 at a tick, where others write 2, and the power above the axis: a legend stands there."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return f"{x:g}" if self.get_offset() else super().__call__(x, pos)


_SYMBOL = re.compile(r"\br_(u|adm)\b")


class Page(Figure):
    """Makes a figure that a notebook shows, whether pyplot has been imported or not."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        FigureCanvasAgg(self).print_png(buffer)
        return buffer.getvalue()


def _typeset(page: Figure) -> None:
    """Set the indices of r_u and r_adm low, in texts that have no formula otherwise."""
    for text in _texts(page):
        written = text.get_text()
        if _SYMBOL.search(written) and not set(written) & set("$\\"):
            text.set_parse_math(True)
            text.set_text(_SYMBOL.sub(r"r$_{\1}$", written))


def _texts(artist: Artist) -> Iterator[Text]:
    """Yield the texts of an artist and its parts, without the numbers at ticks: to list those makes them."""
    for part in artist.get_children():
        if isinstance(part, Axis):
            yield part.label
            continue
        if isinstance(part, Text):
            yield part
        yield from _texts(part)


def rendered(
    paint: Callable[[Figure], object],
    file_type: FileType = "png",
    *,
    width: Width = "page",
    seen: Callable[[Figure], object] | None = None,
) -> bytes:
    """Return the file of a figure that `paint` draws on an empty page; the same figure gives the same file.

    `seen` is called with the page after its layout.
    """
    buffer = io.BytesIO()
    with mpl.rc_context(), warnings.catch_warnings():
        mpl.rcdefaults()  # independent of the user's matplotlibrc
        mpl.rcParams.update(_look(width))
        # The font may lack a letter of the user's: a box replaces it here, but tables and pages have it.
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        page = painted(paint, width)
        for axes in page.axes:
            _strokes(axes)
        # Without a date and with ids that do not change, the same figure is the same file.
        if file_type == "png":
            FigureCanvasAgg(page).print_png(buffer, pil_kwargs={"compress_level": _COMPRESSED})
        elif file_type == "svg":  # by its own canvas: `print_figure` lays a page out and draws it twice
            from matplotlib.backends.backend_svg import FigureCanvasSVG

            FigureCanvasSVG(page).print_svg(buffer, metadata={"Date": None, "Creator": None})
        else:
            nothing = {"CreationDate": None, "Producer": None, "Creator": None}
            FigureCanvasAgg(page).print_figure(buffer, format=file_type, metadata=nothing)
        if seen is not None:
            seen(page)
    return buffer.getvalue()


def _look(width: Width) -> dict[Any, Any]:
    """Return the settings of a page, with one size for all text: titles, ticks and legends alike."""
    return _RC | dict.fromkeys(_SIZES_OF_TEXT, _SIZES[width][2])


def painted(paint: Callable[[Figure], object], width: Width = "page") -> Figure:
    """Return the figure that `paint` draws on an empty page."""
    with mpl.rc_context(_look(width)):
        page = Page(figsize=_SIZES[width][:2], dpi=DPI, layout="constrained")
        paint(page)
        _typeset(page)
        for axis in (axes.yaxis for axes in page.axes):
            if axis.get_scale() == "linear" and type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(_Numbers())
                axis.offsetText.set_visible(False)
    return page


def _strokes(axes: Axes) -> None:
    """Draw the minor ticks of logarithmic axes as one set of marks each, within the present limits.

    A tick is an object with lines and a text of its own: all of them take half of the time of a figure.
    """
    for name, axis, limits, transform, marker in (
        ("x", axes.xaxis, axes.get_xlim(), axes.get_xaxis_transform(), TICKDOWN),
        ("y", axes.yaxis, axes.get_ylim(), axes.get_yaxis_transform(), TICKLEFT),
    ):
        if axis.get_scale() != "log":
            continue
        at = np.asarray(axis.get_minorticklocs(), dtype=float)
        if any(axis.get_minor_formatter().format_ticks(at.tolist())):
            continue  # within a decade they carry numbers
        axis.set_minor_locator(NullLocator())
        at = at[(at >= min(limits)) & (at <= max(limits))]
        edge = np.zeros(at.size)
        places = (at, edge) if name == "x" else (edge, at)
        marks = Line2D(*places, linestyle="none", markersize=2.0, color=BLACK)
        marks.set(marker=marker, transform=transform, clip_on=False, markeredgewidth=0.6, in_layout=False)
        axes.add_artist(marks)


def panels(page: Figure, number: int, columns: int, *, shared: bool = False) -> list[Axes]:
    """Return axes for panels, row by row, in at most this many columns; further rows make a page higher."""
    columns = min(columns, number, max(int(width_for(page) // PANEL), 1))
    rows = -(-number // columns)
    page.set_figheight((1.0 + _ROW * (rows - 1)) * page.get_figheight())
    grid = list(page.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared).flat)
    for axes in grid[number:]:
        axes.set_axis_off()
    return grid[:number]


def frequency_axis(axes: Axes, frequencies: Array, time_unit: str) -> None:
    """Make the horizontal axis logarithmic over the positive `frequencies`, in rad per time unit."""
    positive = frequencies[frequencies > 0]
    if positive.size:
        log_axes(axes, "x")
    if positive.size > 1:
        axes.set_xlim(positive.min(), positive.max())
        if positive.max() < _EVEN * positive.min():
            plain_decades(axes, "x")
    axes.set_xlabel(frequency_label(time_unit))


def frequency_label(time_unit: str) -> str:
    """Return the label of an axis of frequencies."""
    return f"frequency ω (rad/{time_unit})"


def log_axes(axes: Axes, which: Literal["x", "y"], nonpositive: Literal["clip", "mask"] = "clip") -> None:
    """Make one axis logarithmic, `nonpositive` values at its lower end or left out."""
    set_scale, axis = (axes.set_xscale, axes.xaxis) if which == "x" else (axes.set_yscale, axes.yaxis)
    set_scale("log", nonpositive=nonpositive)
    axis.set_major_formatter(_LogTicks())
    axis.set_minor_formatter(_LogTicks())


def plain_decades(axes: Axes, which: Literal["x", "y"]) -> None:
    """Make one axis logarithmic over a few decades about one: 0.5, 1, 2, 5 in place of powers of ten.

    If the range drawn so far would then have only one number or two, the steps are even.
    """
    log_axes(axes, which)
    axis = axes.xaxis if which == "x" else axes.yaxis
    low, high = axis.get_view_interval()
    even = high < _EVEN * low
    wide = high > _WIDE * low
    subs = (1.0,) if wide else (1.0, 2.0, 5.0)
    axis.set_major_locator(MaxNLocator(_STEPS, steps=[1, 2, 5]) if even else LogLocator(subs=subs))
    if even or wide:
        axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def ink_on(cell: ScalarMappable, value: float, opaque: float = 1.0) -> str:
    """Return black or white, whichever stands out more on the colour of a value, drawn on white."""
    colour = cell.to_rgba(np.array(value))
    light = [float(channel) * opaque + 1.0 - opaque for channel in colour[:3]]
    # Relative luminance, and where black and white have the same contrast, by WCAG 2.
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in light]
    luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    return BLACK if luminance > 0.179 else "#FFFFFF"


def marked(axes: Axes, x: Array, y: Array, *, color: str = BLUE, label: str = "") -> None:
    """Draw rings around points of a curve, if there are any."""
    if x.size:
        (rings,) = axes.plot(x, y, "o", markersize=6, clip_on=False, zorder=5, label=label)
        rings.set(markerfacecolor="white", markeredgecolor=color, markeredgewidth=1.5)


def band(
    axes: Axes, x: Array, low: Array, high: Array | float, color: str, alpha: float | None, **more: Any
) -> None:
    """Draw a shade between two curves."""
    axes.fill_between(x, low, high, color=color, alpha=alpha, linewidth=0, **more)


def plot_limit(axes: Axes, top: float) -> None:
    """Draw the limit of a ratio at one, and a shade beyond it up to the top."""
    axes.axhspan(1.0, top, color=ORANGE, alpha=0.07, linewidth=0)
    axes.axhline(1.0, color=ORANGE, linestyle=DASHED, label="limit")


def plot_admitted(axes: Axes, w: Array, r_adm: Array) -> None:
    """Draw the admitted error r_adm as a dashed line with a shade beyond it, alike in all figures.

    It must be called last: the shade ends at the end of the axis.
    """
    admitted = positive(r_adm)
    low, high = axes.get_ylim()
    top = max(high, 1.15 * float(np.nanmax(admitted, initial=0.0)))
    bottom = min(low, 0.87 * float(np.nanmin(admitted, initial=np.inf)))
    band(axes, w, admitted, top, ORANGE, 0.07)
    axes.plot(w, admitted, color=ORANGE, linestyle=DASHED, label="r_adm, admitted")
    axes.set_ylim(bottom, top)


# The dashes change when all colours have been used.
_DASHES: tuple[LineStyleType, ...] = ("solid", (0, (3, 1.5)), (0, (6, 1.5, 1, 1.5)), (0, (1, 1)))
# Their number, 7, has no divisor in common with the 6 colours: 42 pairs are distinct.
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")


def stroke(number: int, colours: Sequence[str] = PALETTE) -> tuple[str, LineStyleType]:
    """Return colour and dashes of a curve by its number from zero; dashes change once colours run out."""
    again, place = divmod(number, len(colours))
    return colours[place], _DASHES[again % len(_DASHES)]


def point(number: int) -> tuple[str, str]:
    """Return colour and marker of a set of points by its number from zero; the first 42 are distinct."""
    return PALETTE[number % len(PALETTE)], _MARKERS[number % len(_MARKERS)]


def positive(values: Array) -> Array:
    """Return `values` with NaN where a logarithmic axis has no place for them (an r_adm below zero, say)."""
    return np.where(values > 0, values, np.nan)


def labelled(*panels: Axes) -> list[Artist]:
    """Return the artists with a label in the order of drawing; for equal labels, the first."""
    found: dict[str, Artist] = {}
    for axes in panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values())


def legend_above(axes: Axes) -> None:
    """Draw a legend of all that has a label over the axes, where it covers no curve."""
    page = axes.get_figure(root=True)
    assert page is not None
    corner = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.3}
    axes.legend(**_legend(labelled(axes), width_for(page) - _BESIDE_AXES, corner))


def width_for(page: Figure) -> float:
    """Return the width of a page in inches, were its text of the usual size."""
    return page.get_figwidth() * TYPE_SIZE / float(mpl.rcParams["font.size"])


def _legend(handles: Sequence[Artist], room: float, place: Mapping[str, object]) -> dict[str, Any]:
    """Return the settings of a legend at a place, with as many columns as there is `room` for, in inches."""
    # A label wider than the page would leave no room for the axes.
    widest = max(int(_TITLE_PER_INCH * (room - _BESIDE_LABEL)), 1)
    labels = [textwrap.fill(str(handle.get_label()), widest) for handle in handles]
    listed = {"handles": handles, "labels": labels, "ncols": _columns(labels, room)}
    return {**listed, "handlelength": 2.0, "columnspacing": 1.2, **place}


def _columns(labels: Sequence[str], room: float) -> int:
    """Return the most columns of a legend, filled one after the other, that fit into `room`, in inches."""
    size, kind = text_to_path.get_text_width_height_descent, FontProperties(size=TYPE_SIZE)
    lines = (_SYMBOL.sub(r"r\1", label).split("\n") for label in labels)
    widths = [_BESIDE_LABEL + max(size(line, kind, False)[0] for line in each) / 72.0 for each in lines]
    for columns in range(len(labels), 1, -1):
        if sum(max(shared) for shared in np.array_split(widths, columns)) <= room:
            return columns
    return 1


def title_above(page: Figure, title: str) -> None:
    """Draw the title of the page, in as many lines as it takes; none if it is empty."""
    if title:
        page.suptitle(_wrapped(page, title), x=0.01, ha="left")


def _wrapped(page: Figure, title: str) -> str:
    return textwrap.fill(title, max(int(_TITLE_PER_INCH * width_for(page)), 1))


def legend_over_all(page: Figure, handles: Sequence[Artist] | None = None, title: str = "") -> None:
    """Draw one legend for all panels of a page, above them: of all that has a label, or of `handles`."""
    handles = labelled(*page.axes) if handles is None else handles
    place = {"loc": "outside upper left", "title": _wrapped(page, title), "alignment": "left"}
    page.legend(**_legend(handles, width_for(page), place))
