"""What the figures of a sweep share: the names of keys, scales, curves, and marks for what has no result."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from inputdesign_cli.figures.style import ORANGE, log_axes
from inputdesign_cli.runs.results import Array

# Values over a wider ratio are drawn on a logarithmic scale; keys from the second ratio on.
LOG_FROM = 10.0
_LOG_KEYS_FROM = 100.0
_DECADES_IN_FULL = 3.0
_NAMES = {
    "experiment.samples": "number of samples N",
    "spectrum.order": "order of the FIR spectrum",
    "accuracy.mean_squared_error.neglected_norm": "bound α on the neglected parameters",
    "accuracy.mean_squared_error.target": "mean squared error γ that is admitted",
}


def key_label(key: str) -> str:
    """What an axis over a key of the spec is called."""
    return _NAMES.get(key, key)


def curve(axes: Axes, x: Array, y: Array, **style: Any) -> list[Artist]:
    """A curve through the points in the order of x."""
    order = np.argsort(x, kind="stable")
    return list(axes.plot(x[order], y[order], **style))


def mark_failures(axes: Axes, where: Array) -> None:
    """Crosses at the foot of the axes where a point has no result."""
    where = where[np.isfinite(where)]
    foot = np.full(where.size, 0.02)
    axes.plot(where, foot, "x", color=ORANGE, transform=axes.get_xaxis_transform(), clip_on=False)


def scale_key(axes: Axes, key: str, x: Array) -> None:
    """The scale and the name of the axis of a key: logarithmic for N and over decades."""
    low, high = float(np.nanmin(x)), float(np.nanmax(x))
    if low > 0 and (key == "experiment.samples" or high > _LOG_KEYS_FROM * low):
        log_axes(axes, "x")
        plain_numbers(axes.xaxis, high / low)
    elif np.all(x == np.round(x)):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel(key_label(key))


def plain_numbers(axis: Axis, ratio: float) -> None:
    """Ticks of a logarithmic axis, written out: powers of ten, over few decades 2 and 5 times them too."""
    subs = (1.0, 2.0, 5.0) if ratio < 10.0**_DECADES_IN_FULL else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
