"""What a drawn figure says along its horizontal axes, read back from it: one who points at it sees values."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from inputdesign_cli.runs.results import Json

# Fewer points are marks and limits; of more every so many are kept.
_FEWEST, _MOST = 20, 400


def readings(page: Figure) -> list[dict[str, Json]]:
    """Of a page that has been laid out: its panels with named curves over an axis.

    `box` is left, top, width and height in shares of the page; `low` and `high` are the ends of the axis.
    """
    return [panel for panel in map(_panel, page.axes) if panel["curves"]]


def _panel(axes: Axes) -> dict[str, Json]:
    place, (low, high) = axes.get_position(), axes.get_xlim()
    lowest = next((other for other in reversed(axes.figure.axes) if other.get_xlabel()), axes)
    return {
        "box": [float(f"{v:.4f}") for v in (place.x0, 1.0 - place.y1, place.width, place.height)],
        "log": axes.get_xscale() == "log",
        "low": float(low),
        "high": float(high),
        "x": (axes.get_xlabel() or lowest.get_xlabel()).split(";")[0],
        "y": axes.get_ylabel(),
        "curves": list(_curves(axes)),
    }


def _curves(axes: Axes) -> Iterator[dict[str, Json]]:
    for line in axes.get_lines():
        name = str(line.get_label()).strip()
        x, y = _points(line)
        if name and not name.startswith("_") and x.size >= _FEWEST and np.all(np.diff(x) > 0.0):
            kept = slice(None, None, -(-x.size // _MOST))
            told = [[float(f"{v:.4g}") for v in values[kept].tolist()] for values in (x, y)]
            yield {"name": name.split(": ")[0], "x": told[0], "y": told[1]}


def _points(line: Line2D) -> tuple[np.ndarray, np.ndarray]:
    """The points (n,) of a curve at which it has a value."""
    x, y = (np.asarray(line.get_data()[k], dtype=float).ravel() for k in (0, 1))
    there = np.isfinite(x) & np.isfinite(y)
    return x[there], y[there]
