"""Values along the curves of a drawn figure, for a page that shows them under the pointer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inputdesign_cli.arrays import Array

# Fewer points without a line are marks; more points are thinned out evenly.
_FEWEST, _MOST = 20, 400


class Traced(Line2D):
    """Draws a curve in the plane along a third variable: a Nyquist plot goes along frequency.

    Args:
        x, y: its points (n,).
        along: the third variable (n,), called `name`.
        values: further values at every point, (n,) by name.
    """

    def __init__(
        self, x: Array, y: Array, along: Array, name: str, values: Mapping[str, Array], **style: Any
    ) -> None:
        super().__init__(x, y, **style)
        self.along, self.name, self.values = along, name, values


def readings(page: Figure) -> list[dict[str, object]]:
    """Return the panels of a laid-out page that have named curves over an axis, or one curve in the plane.

    `box` is left, top, width and height in shares of the page; `low` and `high` are the ends of the axis. A
    panel with a curve in the plane has its `path`, in shares of the panel from the left and from the top.
    """
    return [panel for panel in map(_panel, page.axes) if panel["curves"]]


def _panel(axes: Axes) -> dict[str, object]:
    place, (low, high) = axes.get_position(), axes.get_xlim()
    lines = axes.get_lines()
    box = [float(f"{v:.4f}") for v in (place.x0, 1.0 - place.y1, place.width, place.height)]
    ends = {"box": box, "low": float(low), "high": float(high)}
    traced = next((line for line in lines if isinstance(line, Traced)), None)
    if traced is not None:
        return {**ends, "log": False, **_along(axes, traced)}
    below, beside = (label.replace("$_{", "_").replace("}$", "") for label in _labels(axes))
    curves = [curve for line in lines for curve in _curves(axes, line)]
    return {**ends, "log": axes.get_xscale() == "log", "x": below, "y": beside, "curves": curves}


def _labels(axes: Axes) -> tuple[str, str]:
    """Return the labels of a panel: its own, or of panels beside and below it, or of the page.

    The second label names the panel where there are several.
    """
    page = axes.get_figure(root=True)
    assert page is not None
    lowest = next((other for other in reversed(page.axes) if other.get_xlabel()), axes)
    height = axes.get_position().y0
    row = (other.get_ylabel() for other in page.axes if np.isclose(other.get_position().y0, height))
    below = axes.get_xlabel() or page.get_supxlabel() or lowest.get_xlabel()
    beside = axes.get_ylabel() or next(filter(None, row), "") or page.get_supylabel()
    several = str(axes.get_label()) or ("" if axes.get_ylabel() else axes.get_title(loc="left"))
    return below.split(";")[0], ", ".join(filter(None, (several, beside.replace("\n", " "))))


def _curves(axes: Axes, line: Line2D) -> Iterator[dict[str, object]]:
    """Yield the readings of a named curve over the axis; limits across it and marks have none."""
    name = str(line.get_label()).strip()
    if not name or name.startswith("_") or line.get_transform() != axes.transData:
        return
    x, y = _points(line)
    fewest = _FEWEST if line.get_linestyle() in ("None", "none", "") else 2
    if x.size >= fewest and np.all(np.diff(x) >= 0.0) and x[-1] > x[0]:
        kept = _kept(x.size)
        yield {"name": name.split(": ")[0], "x": _rounded(x[kept]), "y": _rounded(y[kept])}


def _along(axes: Axes, line: Traced) -> dict[str, object]:
    """Return the readings of a curve in the plane at its points within the axes."""
    x, y = (np.asarray(line.get_data()[k], dtype=float) for k in (0, 1))
    across, down = axes.transAxes.inverted().transform(axes.transData.transform(np.stack([x, y], 1))).T
    shown = np.flatnonzero((across >= 0.0) & (across <= 1.0) & (down >= 0.0) & (down <= 1.0))
    shown = shown[_kept(shown.size)]
    at = _rounded(line.along[shown])
    return {
        "x": line.name,
        "y": str(line.get_label()),
        "path": [_rounded(across[shown]), _rounded(1.0 - down[shown])],
        "curves": [{"name": name, "x": at, "y": _rounded(row[shown])} for name, row in line.values.items()]
        if shown.size
        else [],
    }


def _kept(size: int) -> slice:
    return slice(None, None, max(-(-size // _MOST), 1))


def _rounded(values: Array) -> list[float]:
    return [float(f"{v:.4g}") for v in values.tolist()]


def _points(line: Line2D) -> tuple[Array, Array]:
    """Return the points x, y (n,) of a curve at which it has a value."""
    x, y = (np.asarray(line.get_data()[k], dtype=float).ravel() for k in (0, 1))
    there = np.isfinite(x) & np.isfinite(y)
    return x[there], y[there]
