"""Figures of sweeps: curves over a key, maps over two, moments, and trades of length against amplitude."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullLocator
from numpy.typing import NDArray

from inputdesign_cli.figures import style
from inputdesign_cli.figures.style import BLACK, DASHED, DOTTED, GREY, ORANGE, PALETTE
from inputdesign_cli.figures.sweep_table import QUANTITIES, SweepTable, Trade
from inputdesign_cli.outcome.design import OBJECTIVES, objective
from inputdesign_cli.outcome.results import Array
from inputdesign_cli.outcome.run_directory import output_errors, write_bytes

# Bounds that no design of the kind can pass.
BOUNDS = {"objective.any_spectrum_bound": "any spectrum", "objective.any_structure_bound": "any moments"}
MOST_CURVES = len(PALETTE)
MOST_KEYS = 3
NAMES = ("curves", "map", "moments")
COLUMNS = 3  # panels in a row
MOST_LABELLED = 100  # cells of a map that carry their number
_LETTERS = 9.0  # letters of tick labels that an inch of a page holds
_CELL = 0.6  # inches of the page that a column of a map takes where it has numbers
_PREFIX, _TRACE = "moments.entries.", "moments.trace"
_FLAT = 0.02  # relative difference below which criteria look equal
# Values are drawn on a logarithmic scale beyond the first ratio, and keys beyond the second.
LOG_FROM = 10.0
_LOG_KEYS_FROM = 100.0
# Ticks at points: their largest number, and their least distance as a share of the axis.
_MOST_TICKS, _ROOM = 12, 0.055
_NAMES = {
    "experiment.samples": "number of samples N",
    "spectrum.order": "order of the FIR spectrum",
    "accuracy.mean_squared_error.neglected_norm": "bound α on the neglected parameters",
    "accuracy.mean_squared_error.target": "mean squared error γ that is admitted",
}


def draw_sweep(table: SweepTable, root: Path, file_type: str = "png") -> list[Path]:
    """Draw the figures that suit the sweep and return their paths; remove figures of an earlier call."""
    for name in NAMES:
        _remove(root, name)
    return [draw_into(root, name, paint, file_type) for name, paint in sweep_figures(table)]


def draw_into(root: Path, name: str, paint: Callable[[Figure], None], file_type: str) -> Path:
    """Draw a figure of a sweep in place of one in any format, and return its path.

    Raises:
        OutputError: see `write_bytes`.
    """
    content = style.rendered(paint, style.FILE_TYPES[file_type])
    _remove(root, name)
    path = root / f"{name}.{file_type}"
    write_bytes(path, content)
    return path


def _remove(root: Path, name: str) -> None:
    with output_errors(root):
        for file_type in style.FILE_TYPES:
            (root / f"{name}.{file_type}").unlink(missing_ok=True)


def sweep_figures(table: SweepTable) -> list[tuple[str, Callable[[Figure], None]]]:
    """Return the names and drawing functions of a sweep's figures: curves over a numeric key, a map over two.

    With three keys, the curves have a panel for each value of the third. Sweeps over more keys, or with fewer
    than two results, have no figures.
    """
    quantity = next((name for name in QUANTITIES if _usable(table.numbers(name))), None)
    if quantity is None:
        return []
    axes = [key for key in table.axes if len(set(table.columns[key])) > 1]
    numeric = [key for key in axes if _usable(table.numbers(key))]
    zipped = table.summary.zip
    found: list[tuple[str, Callable[[Figure], None]]] = []
    if numeric and (zipped or len(axes) <= MOST_KEYS):
        along, *others = sorted(axes, key=lambda key: (key not in numeric, -len(set(table.columns[key]))))
        # The fewest values make the panels, the others the curves of each.
        across, panels = (None, None) if zipped else (*others, None, None)[:2]
        few = all(len(set(table.columns[key])) <= MOST_CURVES for key in (across, panels) if key)
        if few:
            found.append(("curves", partial(_draw_panels, table, quantity, along, across, panels)))
        if across is None and _moment_entries(table):
            found.append(("moments", partial(_draw_moments, table, along)))
    if not zipped and len(axes) == 2 and len(numeric) == 2:
        found.append(("map", partial(_draw_map, table, quantity, axes[0], axes[1])))
    return found


def _usable(values: Array | None) -> bool:
    return values is not None and int(np.isfinite(values).sum()) > 1


def _label(table: SweepTable, quantity: str) -> str:
    named = quantity == "objective.value" and table.kind in OBJECTIVES
    return OBJECTIVES[table.kind].axis if named else quantity


def _draw_panels(
    table: SweepTable, quantity: str, along: str, across: str | None, panels: str | None, page: Figure
) -> None:
    """Draw curves over one key, a panel for each value of the third, on common axes; name the best point."""
    values = list(dict.fromkeys(table.columns[panels])) if panels else [""]
    grid = style.panels(page, len(values), COLUMNS, shared=True)
    for value, axes in zip(values, grid, strict=True):
        member = np.array([not panels or text == value for text in table.columns[panels or along]])
        _draw_curves(axes, table, quantity, along, across, member)
        if panels:
            axes.set_title(f"{_short(panels)} = {value}", loc="left", color=GREY)
            axes.label_outer()
            # The page has common labels: a single panel has no room for them.
            axes.set_xlabel("")
            axes.set_ylabel("")
    if panels:
        page.supxlabel(key_label(along), fontsize=style.TYPE_SIZE)
        page.supylabel(_label(table, quantity), fontsize=style.TYPE_SIZE)
    named = table.best
    title = f"best: {named[1]}" if named and named[0] == quantity else ""
    if panels or len(style.labelled(grid[0])) > 4:
        style.legend_over_all(page, title=title)
    else:
        style.title_above(page, title)
        style.legend_above(grid[0])


def _draw_curves(
    axes: Axes, table: SweepTable, quantity: str, along: str, across: str | None, shown: NDArray[np.bool_]
) -> None:
    """Draw the quantity and its bound over one key, for each value of the other; without one, also white.

    Only points (n,) that are `shown` are drawn; the scales depend on all.
    """
    x, y = _known(table, along), _known(table, quantity)
    of_value = quantity == "objective.value"
    groups = list(dict.fromkeys(table.columns[across])) if across else [""]
    bound, whatever = bound_of(table) if of_value else (None, "")
    white = (
        table.numbers(f"baseline.white.{objective(table.kind).white}") if of_value and not across else None
    )
    side = f"{'ceiling' if table.maximised else 'floor'}: {whatever}"
    if across and bound is not None:  # each value has a colour, the name has none of them
        axes.plot([], [], color=BLACK, linestyle=DASHED, label=side)[0].set_in_layout(False)
    for group, colour in zip(groups, PALETTE, strict=False):
        member = shown & [not across or text == group for text in table.columns[across or along]]
        name = f"{_short(across)} = {group}" if across else "design"
        curve(axes, x[member], y[member], color=colour, marker="o", markersize=4, label=name)
        if bound is not None:
            shade = colour if across else BLACK
            curve(axes, x[member], bound[member], color=shade, linestyle=DASHED, linewidth=1.1, label=side)
    if white is not None:
        curve(axes, x, white, color=GREY, linestyle=DOTTED, label="white excitation")
    mark_failures(axes, x[~np.isfinite(y) & shown])
    _scale_values(axes, table, [one for one in (y, bound, white) if one is not None])
    scale_key(axes, along, x)
    axes.set_ylabel(_label(table, quantity))


def _known(table: SweepTable, name: str) -> Array:
    """Return a column that is known to have numbers, (n,)."""
    values = table.numbers(name)
    assert values is not None
    return values


def _scale_values(axes: Axes, table: SweepTable, drawn: Sequence[Array]) -> None:
    """Scale the vertical axis: logarithmic over decades, from zero where that is near."""
    low, high = (float(end(np.concatenate(drawn))) for end in (np.nanmin, np.nanmax))
    if low > 0 and high > LOG_FROM * low and table.kind != "D":
        style.plain_decades(axes, "y")
    elif table.maximised:
        # The axis shows differences, unless they are due to rounding.
        half = 0.55 * max(high - low, _FLAT * max(abs(low), abs(high)))
        axes.set_ylim((low + high) / 2 - half, (low + high) / 2 + half)
    elif low > 0:
        axes.set_ylim(bottom=0.0)


def bound_of(table: SweepTable) -> tuple[Array | None, str]:
    """Return the bound (n,) on the objective over all designs of a kind, and the kind; else None and ""."""
    for name, whatever in BOUNDS.items():
        values = table.numbers(name)
        if values is not None and np.isfinite(values).any():
            return values, whatever
    return None, ""


def _draw_map(table: SweepTable, quantity: str, down: str, along: str, page: Figure) -> None:
    """Draw the quantity in colour over two keys; points without a result stay hatched."""
    rows, columns = (sorted(set(table.columns[key]), key=float) for key in (down, along))
    cells = np.full((len(rows), len(columns)), np.nan)
    for r, c, value in zip(table.columns[down], table.columns[along], _known(table, quantity), strict=True):
        cells[rows.index(r), columns.index(c)] = value
    low, high = float(np.nanmin(cells)), float(np.nanmax(cells))
    wide = low > 0 and high > LOG_FROM * low
    norm = LogNorm(low, high) if wide else Normalize(low, high if high > low else low + 1.0)
    axes = page.add_subplot()
    axes.grid(False)
    axes.patch.set(hatch="xxx", edgecolor="#BBBBBB")
    image = axes.pcolormesh(np.ma.masked_invalid(cells), norm=norm, cmap="cividis", rasterized=True)
    bar = page.colorbar(image, label=_label(table, quantity))
    if wide:
        style.plain_decades(bar.ax, "y")
    # Labels side by side need room for their letters; labels above each other need a line each.
    across = -(-sum(len(text) + 2 for text in columns) // int(_LETTERS * style.width_for(page)))
    ticks = ((axes.xaxis, columns, along, across), (axes.yaxis, rows, down, -(-len(rows) // 20)))
    for axis, texts, key, step in ticks:
        axis.set_ticks((np.arange(len(texts))[::step] + 0.5).tolist(), texts[::step])
        axis.set_label_text(key_label(key))
    if cells.size <= MOST_LABELLED and page.get_figwidth() >= _CELL * len(columns):
        for (i, j), value in np.ndenumerate(cells):
            known = bool(np.isfinite(value))
            text, colour = (f"{value:.3g}", style.ink_on(image, value)) if known else ("none", BLACK)
            axes.text(j + 0.5, i + 0.5, text, ha="center", va="center", color=colour)


def _short(key: str | None) -> str:
    return (key or "").rpartition(".")[2]


def _moment_entries(table: SweepTable) -> list[str]:
    """Return the columns of R to draw: upper triangle, or of a large R the diagonal; none without moments."""
    if table.numbers(_TRACE) is None:
        return []
    found = [name for name in table.columns if name.startswith(_PREFIX) and table.numbers(name) is not None]
    if len(found) > MOST_CURVES:
        found = [name for name in found if len(set(_place(name))) == 1]
    return found[:MOST_CURVES]


def _draw_moments(table: SweepTable, along: str, page: Figure) -> None:
    """Draw R11, R12, .. and the trace over a key ([eckhard-mse], Figures 1, 2); crosses without a result."""
    x, trace, entries = _known(table, along), _known(table, _TRACE), _moment_entries(table)
    drawn = [_known(table, name) for name in entries]
    # Entries may coincide (R11 = R22 if the regressors are delayed copies): later curves are thinner.
    widths = np.linspace(5.0, 1.2, len(entries))
    axes = page.add_subplot()
    for name, y, colour, width in zip(entries, drawn, PALETTE, widths, strict=False):
        curve(axes, x, y, color=colour, linewidth=width, label=f"R{style.lowered(*_place(name))}")
    curve(axes, x, trace, color=BLACK, linestyle=DASHED, label="trace R")
    mark_failures(axes, x[~np.isfinite(trace)])
    _scale_values(axes, table, [trace, *drawn])
    scale_key(axes, along, x)
    axes.set_ylabel("moments, summed over the samples")
    style.legend_above(axes)


def _place(name: str) -> list[str]:
    """Return row and column of an entry, from 1."""
    return name.removeprefix(_PREFIX).split("_")[1:]


def key_label(key: str) -> str:
    """Return the label of an axis over a key of the spec."""
    return _NAMES.get(key, key)


def curve(axes: Axes, x: Array, y: Array, **style: Any) -> None:
    """Draw a curve through the points in the order of x."""
    order = np.argsort(x, kind="stable")
    axes.plot(x[order], y[order], **style)


def mark_failures(axes: Axes, where: Array) -> None:
    """Draw crosses at the foot of the axes where a point has no result."""
    where = where[np.isfinite(where)]
    if not where.size:  # the layout would make room for a line without points
        return
    foot = np.full(where.size, 0.02)
    axes.plot(where, foot, "x", color=ORANGE, transform=axes.get_xaxis_transform(), clip_on=False)


def scale_key(axes: Axes, key: str, x: Array) -> None:
    """Set the scale and the label of the axis of a key: logarithmic for N and over decades.

    Up to a dozen points have the only ticks, if they are not too near to each other.
    """
    points = np.unique(x[np.isfinite(x)])
    wide = points[0] > 0 and (key == "experiment.samples" or points[-1] > _LOG_KEYS_FROM * points[0])
    if wide:
        style.plain_decades(axes, "x")
    elif np.all(x == np.round(x)):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    place = np.log(points) if wide else points
    if 1 < points.size <= _MOST_TICKS and np.diff(place).min() > _ROOM * np.ptp(place):
        axes.set_xticks(points, [f"{point:g}" for point in points])
        axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(key_label(key))


def draw_trade(trade: Trade, page: Figure) -> None:
    """Draw the ratios to the required accuracy, which is one, or the criterion, over the length."""
    axes = page.add_subplot()
    for number, (name, row) in enumerate(trade.rows.items()):
        colour, dashes = style.stroke(number)
        drawn = {"color": colour, "linestyle": dashes, "label": name}
        curve(axes, trade.lengths, row, marker="o", markersize=4, **drawn)
    scale_key(axes, "experiment.samples", trade.lengths)
    axes.set_xlabel(f"length of the experiment ({trade.unit})")
    mark_failures(axes, trade.lengths[np.all(np.isnan([*trade.rows.values()]), axis=0)])
    if trade.criterion:
        axes.set_ylabel("criterion")
    else:
        axes.axhline(1.0, color=BLACK, linestyle=DASHED, linewidth=1.1, label="what is asked")
        style.plain_decades(axes, "y")
        axes.set_ylabel("error of the record / what is asked")
    style.legend_above(axes)
