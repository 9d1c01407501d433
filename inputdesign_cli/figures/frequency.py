"""Figures over frequency, a panel for every entry of G: errors and their limits, responses, the loop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch
from numpy.typing import NDArray

from inputdesign_cli.figures import style
from inputdesign_cli.figures.readings import Traced
from inputdesign_cli.figures.style import BLACK, BLUE, DASHED, DOTTED, GREEN, GREY, ORANGE, OTHERS, lowered
from inputdesign_cli.outcome import curves as of
from inputdesign_cli.outcome.curves import NyquistCurves
from inputdesign_cli.outcome.results import Array

# Factors on the height of a page with a panel below one other, or below several; share for a further row.
_TALL, _TALLER, _HIGHER = 1.25, 1.4, 0.3
_ROWS, _MOST = 3, 9  # rows of a plant, and entries in all, for which a page has room
# Other ratios beyond this many times the limit, or the first one, are cut off by the linear panel.
_HIGHEST = 4.0
# Ratios that all stay below this share of the limit are flat on a linear axis: they are drawn over decades.
_FAR_BELOW = 0.25
# A gain below this share of the least error is drawn at that share.
_FAR = 1e-2
# Numbers of plants drawn as lines and in colour at most, and the least ratio shown relative to the largest.
_MOST_LINES, MOST_NAMED, _LEAST = 200, 5, 1e-3


LIMITING = "limiting frequencies"  # a requirement binds there; rings mark them
P = TypeVar("P", bound=of.Panel)
_DISCS = 36  # error discs along the curve at most
# Limits of the complex plane that are shown: the margins of a loop are seen around -1 and 0.
_LEFT, _RIGHT, _HALF = -2.2, 1.2, 1.35


def draw_panels(
    page: Figure,
    panels: Sequence[P],
    plot: Callable[[Axes, P], None],
    time_unit: str,
    *,
    magnitude: str,
    title: str = "",
    below: Callable[[Axes, Sequence[P]], object] | None = None,
) -> None:
    """Draw each panel with `plot`, outputs as rows, and all of them together in a further panel with `below`.

    Entries that do not fit side by side follow each other; the first ones are drawn if they are many.

    Args:
        magnitude: the label of the vertical axes at the left.
        title: the common title of all panels.
    """
    single = len(panels) == 1
    places = [(0, 0)] if single else [panel.entry or (0, 0) for panel in panels]
    across = int(style.width_for(page) // style.PANEL)
    if any(row >= _ROWS or column >= across for row, column in places):
        title += f", {_MOST} of {len(panels)} entries" if len(panels) > _MOST else ""
        panels = panels[:_MOST]
        places = [divmod(number, across) for number in range(len(panels))]
    rows, columns = (1 + max(place[side] for place in places) for side in (0, 1))
    heights = [3] * rows
    page.set_figheight((1.0 + _HIGHER * max(rows - 2, 0)) * page.get_figheight())
    if below is not None:
        page.set_figheight((_TALL if single else _TALLER) * page.get_figheight())
        heights.append(2)
    cells = page.add_gridspec(len(heights), columns, height_ratios=heights)
    for panel, (i, j) in zip(panels, places, strict=True):
        axes = page.add_subplot(cells[i, j])
        plot(axes, panel)
        style.frequency_axis(axes, panel.frequency, time_unit)
        if not any(row == i and column < j for row, column in places):
            axes.set_ylabel(magnitude)
        if single:
            title = ": ".join(filter(None, (title, panel.names)))
        else:
            axes.set_label(f"G{lowered(*(1 + side for side in panel.entry or (0, 0)))} {panel.names}".strip())
            axes.set_title(str(axes.get_label()), loc="left", color=GREY)
        if below is not None or any(row > i and column == j for row, column in places):
            axes.tick_params(which="both", labelbottom=False)
            axes.set_xlabel("")
    if single:
        style.title_above(page, title)
        style.legend_above(axes)
    else:
        style.legend_over_all(page, title=title.removeprefix(", "))
    if below is not None:
        lowest = page.add_subplot(cells[rows, :])
        below(lowest, panels)
        style.frequency_axis(lowest, panels[0].frequency, time_unit)
        style.legend_above(lowest)


def draw_bound(page: Figure, curves: of.BoundCurves, time_unit: str) -> None:
    """Draw r_u of design, record and white excitation against r_adm, and their ratios on a linear axis.

    Where nothing is asked of the error, r_u is drawn against |G|.
    """
    stated = [panel for panel in curves.panels if panel.r_adm is not None]
    title = "Model error r_u against the admitted error r_adm" if stated else "Model error r_u beside |G|"
    title += ", at the plant of the spec" if curves.of_several else ""
    below = _plot_ratios if stated else None
    panels = list(curves.panels)
    if len(panels) > _MOST:  # the entries nearest to r_adm, or to |G|, are drawn
        worst = [np.nanmax(one.r_u / (one.G_abs if one.r_adm is None else one.r_adm)) for one in panels]
        panels = [panels[number] for number in np.argsort(worst)[::-1]]
    draw_panels(page, panels, _plot_error, time_unit, magnitude="error of G", title=title, below=below)


def _errors(curves: of.BoundPanel) -> list[tuple[str, Array, dict[str, Any]]]:
    """Return name, values and look of each r_u that is known, the widest line first: others show on it."""
    needed, equal = curves.white_labels
    found: list[tuple[str, Array | None, dict[str, Any]]] = [
        (curves.label, curves.r_u, {"color": BLUE, "linewidth": 2.4}),
        ("record", curves.r_u_record, {"color": GREEN, "linewidth": 1.2, "linestyle": DASHED}),
        (equal, curves.r_u_equal, {"color": GREY, "linewidth": 1.4}),
        (needed, curves.r_u_white, {"color": GREY, "linestyle": DOTTED}),
    ]
    return [(name, values, look) for name, values, look in found if values is not None]


def _plot_error(axes: Axes, curves: of.BoundPanel) -> None:
    """Draw the curves of one entry, in the range of the errors."""
    w, errors = curves.frequency, _errors(curves)
    style.log_axes(axes, "y")
    for name, values, look in errors:
        axes.plot(w, style.positive(values), label=f"r_u, {name}", **look)
    if curves.r_adm is not None:
        style.plot_admitted(axes, w, curves.r_adm)
    else:
        least = _FAR * min(float(np.nanmin(style.positive(values))) for _, values, _ in errors)
        gain = np.maximum(curves.G_abs, least)  # a vanishing one would stretch the axis without end
        axes.plot(w, gain, color=BLACK, linewidth=1.2, label="|G|")
    height = np.exp(np.interp(curves.active, w, np.log(curves.r_u)))
    style.marked(axes, curves.active, height, label=LIMITING)


def _plot_ratios(axes: Axes, panels: Sequence[of.BoundPanel]) -> None:
    """Draw r_u / r_adm, the largest in the legend: all curves of one entry, or of several the design's."""
    tops, ratios = [1.0], [np.zeros(0)]
    for number, curves in enumerate(panels):
        if curves.r_adm is None:
            continue
        drawn = _errors(curves)
        if len(panels) > 1:
            at = "" if curves.entry is None else f"G{curves.entry[0] + 1}{curves.entry[1] + 1}"
            color, dashes = style.stroke(number, OTHERS)
            drawn = [(at, curves.r_u, {"color": color, "linestyle": dashes})]
        for place, (name, values, look) in enumerate(drawn):
            ratio = values / style.positive(curves.r_adm)
            top = float(np.nanmax(ratio, initial=0.0))
            # White excitation that meets the same requirement has the same maximum: it needs no label here.
            same = curves.r_u_equal is not None and values is curves.r_u_white
            axes.plot(curves.frequency, ratio, label="" if same else f"{name}: up to {top:.3g}", **look)
            tops.append(top if not place else min(top, _HIGHEST * max(tops)))
            ratios.append(ratio[ratio > 0])
        if len(panels) == 1:
            height = np.interp(curves.active, curves.frequency, curves.r_u / style.positive(curves.r_adm))
            style.marked(axes, curves.active, height)
    style.plot_limit(axes, 1.12 * max(tops) + 1.0)
    axes.set_ylim(0.0, 1.12 * max(tops))
    values = np.concatenate(ratios)
    if values.size and values.max() < _FAR_BELOW:
        style.plain_decades(axes, "y")
        axes.set_ylim(max(0.8 * float(values.min()), _FAR * float(values.max())), 1.3)
    axes.set_ylabel("r_u / r_adm")


def draw_deviations(page: Figure, curves: of.DeviationCurves, time_unit: str) -> None:
    """Draw |G|, the standard deviations and r_adm at every line."""
    draw_panels(page, curves.panels, _plot_deviations, time_unit, magnitude="magnitude")


def _plot_deviations(axes: Axes, panel: of.DeviationPanel) -> None:
    w = panel.frequency
    style.log_axes(axes, "y")
    axes.plot(w, panel.G_abs, ".-", color=BLACK, linewidth=1.0, markersize=4, label="|G|")
    axes.plot(w, panel.deviation, "o", color=BLUE, markersize=5, label="standard deviation")
    if panel.found is not None:
        axes.plot(w, panel.found, "x", color=GREEN, markersize=6, label=panel.label)
    style.plot_admitted(axes, w, panel.r_adm)


def draw_response(page: Figure, curves: of.ResponseCurves, time_unit: str) -> None:
    """Draw the magnitudes with a 95 % band for the true one; below them the phases."""
    draw_panels(page, curves.panels, _magnitude, time_unit, magnitude="magnitude", below=_phases)


def _magnitude(axes: Axes, panel: of.ResponsePanel) -> None:
    w, size, modelled = panel.frequency, np.abs(panel.G), np.abs(panel.model)
    style.log_axes(axes, "y")
    axes.plot(w, size, ".", color=BLUE, markersize=4, label="|G|, data alone")
    axes.plot(w, modelled, color=BLACK, linewidth=1.2, label="|G|, model")
    least = 0.1 * min(float(size.min()), float(modelled.min()))
    style.band(axes, w, np.maximum(size - panel.radius, least), size + panel.radius, BLUE, 0.15)


def _phases(axes: Axes, panels: Sequence[of.ResponsePanel]) -> None:
    """Draw the phases of all entries, unwrapped for models; known ones of data on the branch nearest to them.

    A negative gain begins half a turn away from a positive one.
    """
    for number, panel in enumerate(panels):
        color, dashes = style.stroke(number)
        of_data, (row, column) = color, panel.entry or (0, 0)
        label = f"G{lowered(row + 1, column + 1)}"
        if len(panels) == 1:
            of_data, color, label = BLUE, BLACK, "model"
        model = np.degrees(np.unwrap(np.angle(panel.model)))
        known = panel.radius < np.abs(panel.G)
        turn = np.degrees(np.angle(panel.G)) - model
        nearest = model + (turn + 180.0) % 360.0 - 180.0
        axes.plot(panel.frequency[known], nearest[known], ".", color=of_data, markersize=4)
        axes.plot(panel.frequency, model, color=color, linestyle=dashes, linewidth=1.2, label=label)
    axes.set_ylabel("phase (degrees)")


def draw_fan(page: Figure, curves: of.FanCurves, time_unit: str) -> None:
    """Draw a line for every plant, with the plants that decide the design in colour; one is the limit."""
    axes = page.add_subplot()
    style.plain_decades(axes, "y")
    w, rows, number = curves.frequency, curves.ratios[:_MOST_LINES], len(curves.ratios)
    width = 0.5 if len(rows) > 20 else 0.8
    if number:
        drawn: dict[str, Any] = {"color": GREY, "linewidth": width, "alpha": 0.45}
        axes.plot(w, rows.T, **drawn)
        axes.plot([], [], label=f"each of {number} plants", **drawn)  # no single curve has this name
        largest, label = curves.ratios.max(axis=0), f"largest of {number} plants"
        axes.plot(w, largest, color=GREY, linestyle=DOTTED, linewidth=1.4, label=label)
    axes.plot(w, curves.nominal, color=BLACK, linewidth=1.4, label="plant of the spec")
    for (name, ratio), color in zip(list(curves.active.items())[:MOST_NAMED], OTHERS, strict=False):
        axes.plot(w, ratio, color=color, linewidth=1.4, label=f"decides, {name}")
    shown = rows if len(rows) else curves.nominal
    top = 1.3 * max(float(shown.max()), 1.0)
    style.plot_limit(axes, top)
    axes.set_ylim(max(float(shown.min()) * 0.8, _LEAST * float(shown.max())), top)
    style.frequency_axis(axes, w, time_unit)
    axes.set_ylabel("r_u / r_adm")
    style.legend_above(axes)


def draw_error_bands(page: Figure, curves: of.ErrorBandCurves, time_unit: str) -> None:
    """Draw the median and the central band of |G_hat - G_0| over frequency, with r_u and r_adm."""
    plot, title = partial(_plot_bands, runs=curves.runs), f"Errors of the models: {curves.name}"
    draw_panels(page, curves.panels, plot, time_unit, magnitude="|Ĝ − G₀|", title=title)


def _plot_bands(axes: Axes, curves: of.ErrorBandPanel, *, runs: int) -> None:
    w, (low, *between, high) = curves.frequency, sorted(curves.quantiles)
    outer = curves.quantiles[high]
    style.log_axes(axes, "y")
    label = f"{100 * low:g} to {100 * high:g} % of {runs} runs"
    style.band(axes, w, curves.quantiles[low], outer, BLUE, 0.25, label=label)
    for level in between:
        axes.plot(w, curves.quantiles[level], color=BLUE, label=f"{100 * level:g} %")
    if curves.r_u is not None:
        axes.plot(w, curves.r_u, color=BLACK, linestyle=DOTTED, label="r_u, predicted")
    if curves.r_adm is not None:
        admitted = style.positive(curves.r_adm)
        beyond = outer > admitted
        if np.any(beyond):
            label = f"where more than {100 * (1.0 - high):.2g} % of the runs leave r_adm"
            style.band(axes, w, admitted, outer, ORANGE, None, label=label, where=beyond)
        style.plot_admitted(axes, w, curves.r_adm)


def draw_nyquist(page: Figure, curves: NyquistCurves, time_unit: str) -> None:
    """Draw C G over frequency, discs of radius |C| r_u along it, -1, and the circle that it must avoid."""
    axes = page.add_subplot()
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(_LEFT, _RIGHT)
    axes.set_ylim(-_HALF, _HALF)
    L, radius = curves.loop, curves.radius
    at = np.union1d(
        _along(np.where(_shown(L), L, np.nan)), np.searchsorted(curves.frequency, curves.limiting)
    )
    at = at[at < L.size]
    for centre, size in zip(L[at], radius[at], strict=True):
        disc = Circle((centre.real, centre.imag), size, color=BLUE, alpha=0.14, linewidth=0.5)
        axes.add_patch(disc)
    values = {
        "real part": L.real,
        "imaginary part": L.imag,
        "radius of its disc": radius,
        "distance of the disc from −1": np.abs(1.0 + L) - radius,
    }
    line = Traced(L.real, L.imag, curves.frequency, style.frequency_label(time_unit), values, color=BLUE)
    line.set_label("C G, nominal")
    axes.add_line(line)
    handles: list[Artist] = [line, Patch(color=BLUE, alpha=0.3, label="model error |C| r_u")]
    if curves.circle is not None:
        axes.add_patch(Circle((-1.0, 0.0), curves.circle, color=ORANGE, alpha=0.07, linewidth=0))
        axes.add_patch(
            Circle((-1.0, 0.0), curves.circle, fill=False, edgecolor=ORANGE, linestyle=DASHED, linewidth=1.6)
        )
        label = f"not admissible: |S| above {1.0 / curves.circle:.3g}"
        handles.append(Patch(facecolor="#FDF1E9", edgecolor=ORANGE, linestyle=DASHED, label=label))
    limiting = np.interp(curves.limiting, curves.frequency, L)
    limiting = limiting[_shown(limiting)]  # rings are drawn beyond the axes, too, and would shift the layout
    if limiting.size:
        style.marked(axes, limiting.real, limiting.imag, label=LIMITING)
    axes.plot([-1.0], [0.0], "+", color=BLACK, markersize=10, markeredgewidth=1.6)
    axes.annotate("−1", (-1.0, 0.0), (4, 5), textcoords="offset points")
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(np.cos(turn), np.sin(turn), color=GREY, linewidth=0.6)
    axes.set_xlabel("real part of C G")
    axes.set_ylabel("imaginary part of C G")
    style.legend_over_all(page, list(dict.fromkeys([*handles, *style.labelled(axes)])))


def _shown(L: NDArray[np.complex128]) -> NDArray[np.bool_]:
    """Return the mask (n,) of the points of L (n,) within the axes."""
    return (L.real > _LEFT) & (L.real < _RIGHT) & (np.abs(L.imag) < _HALF)


def _along(L: NDArray[np.complex128]) -> NDArray[np.int_]:
    """Return indices (m,) of points of L (n,) evenly along the curve, where it is shown (NaN where not)."""
    inside = np.flatnonzero(np.isfinite(L))
    if inside.size <= _DISCS:
        return inside
    steps = np.abs(np.diff(L[inside], prepend=L[inside[0]]))
    length = np.cumsum(np.minimum(steps, 0.2))
    return inside[
        np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], _DISCS)).clip(0, inside.size - 1))
    ]
